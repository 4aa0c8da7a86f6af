//! The fast form of the method.

pub(crate) mod lanes;
pub(crate) mod windows;
