//! LZF decompression, as PCL's `binary_compressed` files need it.

/// The `length` bytes that `input` stands for; none if it is damaged.
pub(crate) fn decompress(input: &[u8], length: usize) -> Option<Vec<u8>> {
    let mut output = Vec::with_capacity(length);
    let mut input = input.iter().copied();
    while let Some(control) = input.next() {
        let control = usize::from(control);
        if control < 32 {
            for _ in 0..=control {
                output.push(input.next()?);
            }
        } else {
            let mut count = control >> 5;
            if count == 7 {
                count += usize::from(input.next()?);
            }
            let back = ((control & 31) << 8) + usize::from(input.next()?) + 1;
            let from = output.len().checked_sub(back)?;
            for i in 0..count + 2 {
                output.push(output[from + i]);
            }
        }
        if output.len() > length {
            return None;
        }
    }
    (output.len() == length).then_some(output)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_and_overlapping_copies_come_out() {
        let packed = [1, b'a', b'b', 0x60, 1, 0, b'c'];
        assert_eq!(decompress(&packed, 8), Some(b"abababac".to_vec()));
        assert_eq!(decompress(&[0x20, 9], 3), None);
    }
}
