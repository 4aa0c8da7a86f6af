//! What the experiments share: modes to compare, and errors by band with coverage.

pub mod errors;
pub mod modes;
