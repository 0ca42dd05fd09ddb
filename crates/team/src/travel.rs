//! Values as bytes, on their way from one process to another: what serde makes of them, by postcard.
//!
//! A process is alone without a library that connects it with others, the feature `mpi`: then all values may travel,
//! and none does.

#[cfg(feature = "mpi")]
use serde::{Serialize, de::DeserializeOwned};

/// A value that processes can hand each other.
#[cfg(feature = "mpi")]
pub trait Travels: Serialize + DeserializeOwned + Send {}

#[cfg(feature = "mpi")]
impl<T: Serialize + DeserializeOwned + Send> Travels for T {}

/// A value that processes can hand each other.
#[cfg(not(feature = "mpi"))]
pub trait Travels: Send {}

#[cfg(not(feature = "mpi"))]
impl<T: Send> Travels for T {}

/// Adds a value to a message.
#[cfg(feature = "mpi")]
pub fn write<T: Travels>(value: &T, message: &mut Vec<u8>) {
    postcard::to_io(value, message).expect("memory takes numbers, and lists of them");
}

/// A message of one value.
pub fn message<T: Travels>(value: &T) -> Vec<u8> {
    let mut message = Vec::new();
    write(value, &mut message);
    message
}

/// Takes the next value from a message.
#[cfg(feature = "mpi")]
pub fn read<T: Travels>(message: &mut &[u8]) -> T {
    let (value, rest) = postcard::take_from_bytes(message).expect("what another process of the same program made");
    *message = rest;
    value
}

#[cfg(not(feature = "mpi"))]
pub fn write<T: Travels>(_: &T, _: &mut Vec<u8>) {}

#[cfg(not(feature = "mpi"))]
pub fn read<T: Travels>(_: &mut &[u8]) -> T {
    unreachable!("processes are connected by the feature mpi")
}

#[cfg(all(test, feature = "mpi"))]
mod tests {
    use super::*;

    #[test]
    fn values_come_one_after_the_other_as_they_were() {
        let mut message = Vec::new();
        write(&(1_u64, f64::NAN), &mut message);
        write(&vec![Some(-0.0_f32), None], &mut message);
        let mut rest = &message[..];
        let (number, nan): (u64, f64) = read(&mut rest);
        assert_eq!((number, nan.to_bits()), (1, f64::NAN.to_bits()));
        assert_eq!(read::<Vec<Option<f32>>>(&mut rest).len(), 2);
        assert!(rest.is_empty());
    }
}
