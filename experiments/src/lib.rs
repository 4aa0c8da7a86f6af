//! What the experiments share: modes to compare, errors by band with coverage, files that programs in other
//! languages read and write, and plots.

pub mod errors;
pub mod exchange;
pub mod figures;
pub mod modes;
pub mod parallel;
pub mod picture;
pub mod plot;
pub mod ranking;
pub mod table;
