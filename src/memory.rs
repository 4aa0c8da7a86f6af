//! Tables, some of them kept from frame to frame. Memory that is not there is an error.

use std::collections::TryReserveError;

use crate::Error;

impl From<TryReserveError> for Error {
    fn from(_: TryReserveError) -> Self {
        Error::OutOfMemory
    }
}

/// A table of these values.
pub(crate) fn table<T>(values: impl ExactSizeIterator<Item = T>) -> Result<Vec<T>, Error> {
    let mut table = Vec::new();
    refill(&mut table, values)?;
    Ok(table)
}

/// Puts other values into a table.
pub(crate) fn refill<T>(
    table: &mut Vec<T>,
    values: impl ExactSizeIterator<Item = T>,
) -> Result<(), Error> {
    make_room(table, values.len())?;
    table.extend(values);
    Ok(())
}

/// Empties a table, with room for so many values.
pub(crate) fn make_room<T>(table: &mut Vec<T>, count: usize) -> Result<(), Error> {
    table.clear();
    Ok(table.try_reserve(count)?)
}

/// Makes a table as long as this; what is new in it is this value.
pub(crate) fn resize<T: Clone>(table: &mut Vec<T>, length: usize, value: T) -> Result<(), Error> {
    table.try_reserve(length.saturating_sub(table.len()))?;
    table.resize(length, value);
    Ok(())
}

/// Bytes that a table holds.
pub(crate) fn bytes<T>(table: &Vec<T>) -> usize {
    table.capacity() * size_of::<T>()
}
