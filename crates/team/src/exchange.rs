//! What processes that share one solve must be able to do: hand each other bytes and numbers.
//!
//! Not handled: what the bytes mean ([`crate::travel`]), and who works on what ([`crate::loops`]).

/// The bytes of each process.
pub struct Gathered {
    /// One after the other.
    pub bytes: Vec<u8>,
    /// How many are of each.
    pub sizes: Vec<usize>,
}

impl Gathered {
    /// Those of each, by rank.
    pub fn of_ranks(&self) -> impl Iterator<Item = &[u8]> {
        let mut rest = &self.bytes[..];
        self.sizes.iter().map(move |&size| {
            let own;
            (own, rest) = rest.split_at(size);
            own
        })
    }
}

/// Some processes that hand each other bytes.
pub trait Team: Send + Sync {
    /// How many they are.
    fn size(&self) -> usize;

    /// Which of them this one is, from 0 on.
    fn rank(&self) -> usize;

    /// The bytes that each hands in, in the order of their ranks.
    fn gather(&self, own: &[u8]) -> Gathered;

    /// The numbers that each hands in one after the other, where it is known how many.
    fn join(&self, own: &[f32], counts: &[usize]) -> Vec<f32>;

    /// Hands part k of `own` to rank k; returns what each has for this one.
    fn hand_out(&self, own: &[Vec<u8>]) -> Vec<Vec<u8>>;

    /// Ends all of them.
    fn abort(&self, code: i32) -> !;
}
