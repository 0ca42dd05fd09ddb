//! What paths say of a solution, and how many of them are to say it.
//!
//! Not handled: what is done about it ([`crate::render::residual_check`]).

/// What paths say of the light on patches, beside what two levels of patches and two scramblings do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Finding {
    /// No more, or nothing that matters.
    Agrees,
    /// More: patches of this size do not stand for the scene.
    Wrong,
    /// An error that matters, which noise of F alone may explain: with fewer rays than this patches cannot be judged.
    Noisy,
}

/// What paths say of a solution.
pub(crate) struct Judgement {
    pub finding: Finding,
    /// Chance does not explain that.
    pub is_certain: bool,
    /// It may be.
    pub is_suspicious: bool,
    /// Squared error that paths cannot tell from none over what they should tell: of small places, and of blocks of
    /// pixels as large as tell it best.
    pub blindness: [f64; 2],
}

impl Judgement {
    /// Whether paths tell too little for their number.
    pub fn is_blind(&self) -> bool {
        !self.is_certain && self.blindness.iter().any(|&needed| needed > 1.0)
    }

    /// How many paths of a pixel are to judge, of which `each` have.
    pub fn paths(&self, each: u32, most: [u32; 2], accept: bool) -> u32 {
        if self.is_certain {
            return each;
        }
        let suspicious = if self.is_suspicious { 2.0 } else { 1.0 };
        // The standard error of a square falls as the number.
        let needed = if accept { self.blindness } else { [1.0; 2] };
        let paths = |needed: f64, most: u32| ((needed * f64::from(each)).ceil() as u32).min(most);
        let [small, large] = needed;
        paths(small.max(suspicious), most[0]).max(paths(large.max(1.0), most[1])).max(each)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bulb in a shade was 5.8 % off with 1.7 stated: light came by so few ways that 65,536 paths told nothing, and
    /// what was not told counted as none.
    #[test]
    fn paths_become_more_until_blocks_of_some_size_tell() {
        let paths = |is_certain: bool, blindness: [f64; 2], accept: bool| {
            let finding = Finding::Agrees;
            Judgement { finding, is_certain, is_suspicious: false, blindness }.paths(4, [20, 300], accept)
        };
        assert_eq!(paths(false, [1e3, 30.0], true), 120);
        assert_eq!(paths(false, [1e3, 1e3], true), 300);
        // Small places alone are worth less.
        assert_eq!(paths(false, [1e3, 0.5], true), 20);
        assert_eq!([paths(false, [1e3, 30.0], false), paths(true, [1e3, 30.0], true)], [4, 4]);
    }
}
