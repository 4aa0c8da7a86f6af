//! PCD files: points (or normals) of organized clouds.

use std::io;
use std::path::Path;

use crate::lzf;

/// An organized cloud as a PCD file holds it.
#[derive(Clone, Debug, PartialEq)]
pub struct Pcd {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The points, row by row.
    pub points: Vec<[f32; 3]>,
}

struct Header<'a> {
    fields: Vec<&'a str>,
    sizes: Vec<usize>,
    types: Vec<&'a str>,
    counts: Vec<usize>,
    width: usize,
    height: usize,
    data: &'a str,
}

fn parse_header(text: &str) -> Option<Header<'_>> {
    let line = |key: &str| {
        text.lines().find_map(|line| {
            let mut words = line.split_whitespace();
            (words.next()? == key).then(|| words.collect::<Vec<_>>())
        })
    };
    let numbers = |key: &str| -> Option<Vec<usize>> {
        line(key)?.into_iter().map(|word| word.parse().ok()).collect()
    };
    let fields = line("FIELDS")?;
    Some(Header {
        sizes: numbers("SIZE")?,
        types: line("TYPE")?,
        counts: numbers("COUNT").unwrap_or_else(|| vec![1; fields.len()]),
        fields,
        width: *numbers("WIDTH")?.first()?,
        height: *numbers("HEIGHT")?.first()?,
        data: line("DATA")?.first()?,
    })
}

impl Pcd {
    /// Reads the points (fields x, y, z of type float) of an ascii, binary or binary_compressed file.
    ///
    /// Errors: those of the file system, and [`io::ErrorKind::InvalidData`] if it is not such a file.
    pub fn read(path: impl AsRef<Path>) -> io::Result<Pcd> {
        Self::parse(&std::fs::read(path)?)
    }

    /// The same of a file's bytes.
    ///
    /// Errors: as [`Pcd::read`].
    pub fn parse(bytes: &[u8]) -> io::Result<Pcd> {
        let broken = |text: &str| io::Error::new(io::ErrorKind::InvalidData, text);
        let data_line =
            bytes.windows(5).position(|window| window == b"DATA ").ok_or(broken("no DATA line"))?;
        let line_end =
            bytes[data_line..].iter().position(|byte| *byte == b'\n').ok_or(broken("no data"))?;
        let (header, data) = bytes.split_at(data_line + line_end + 1);
        let header = std::str::from_utf8(header).map_err(|_| broken("the header is not text"))?;
        let header = parse_header(header).ok_or(broken("the header lacks a line"))?;
        let pixels = header
            .width
            .checked_mul(header.height)
            .filter(|pixels| *pixels <= 1 << 30)
            .ok_or(broken("the size is too large"))?;
        let count = header.fields.len();
        if [header.sizes.len(), header.types.len(), header.counts.len()] != [count; 3] {
            return Err(broken("the header's lists differ in length"));
        }
        let mut columns = [0; 3];
        for (column, name) in columns.iter_mut().zip(["x", "y", "z"]) {
            *column = header
                .fields
                .iter()
                .position(|field| *field == name)
                .ok_or(broken("a field is missing"))?;
            let kind = (header.types[*column], header.sizes[*column], header.counts[*column]);
            if kind != ("F", 4, 1) {
                return Err(broken("a field is not one float"));
            }
        }
        let widths: Vec<usize> =
            header.sizes.iter().zip(&header.counts).map(|(size, count)| size * count).collect();
        let before = |column: usize| widths[..column].iter().sum::<usize>();
        let stride = before(count);
        let points = match header.data {
            "ascii" => ascii(data, &header, columns, pixels),
            "binary" => {
                let offsets = columns.map(before);
                floats(data, pixels, |pixel, i| pixel * stride + offsets[i])
            }
            "binary_compressed" => {
                let unpacked = uncompressed(data, stride * pixels)
                    .ok_or(broken("the compressed data is damaged"))?;
                // Compressed files hold one field after the other.
                let offsets = columns.map(|column| before(column) * pixels);
                floats(&unpacked, pixels, |pixel, i| offsets[i] + pixel * 4)
            }
            _ => return Err(broken("unknown kind of data")),
        };
        let points = points.ok_or(broken("the data is too short"))?;
        Ok(Pcd { width: header.width, height: header.height, points })
    }

    /// Writes a binary file whose three float fields have these names.
    pub fn write(&self, path: impl AsRef<Path>, names: [&str; 3]) -> io::Result<()> {
        let pixels = self.points.len();
        let header = format!(
            "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS {}\nSIZE 4 4 4\nTYPE F F F\n\
             COUNT 1 1 1\nWIDTH {}\nHEIGHT {}\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {pixels}\nDATA binary\n",
            names.join(" "),
            self.width,
            self.height,
        );
        let mut bytes = header.into_bytes();
        bytes.extend(self.points.iter().flatten().flat_map(|number| number.to_le_bytes()));
        std::fs::write(path, bytes)
    }
}

fn ascii(
    data: &[u8],
    header: &Header,
    columns: [usize; 3],
    pixels: usize,
) -> Option<Vec<[f32; 3]>> {
    let before = |column: usize| header.counts[..column].iter().sum::<usize>();
    let words = columns.map(before);
    let lines = std::str::from_utf8(data).ok()?.lines().filter(|line| !line.trim().is_empty());
    let points: Option<Vec<[f32; 3]>> = lines
        .take(pixels)
        .map(|line| {
            let line: Vec<&str> = line.split_whitespace().collect();
            let number = |i: usize| line.get(words[i])?.parse().ok();
            Some([number(0)?, number(1)?, number(2)?])
        })
        .collect();
    points.filter(|points| points.len() == pixels)
}

fn uncompressed(data: &[u8], length: usize) -> Option<Vec<u8>> {
    let size =
        |at: usize| Some(u32::from_le_bytes(data.get(at..at + 4)?.try_into().ok()?) as usize);
    if size(4)? != length {
        return None;
    }
    lzf::decompress(data.get(8..8 + size(0)?)?, length)
}

fn floats(
    data: &[u8],
    pixels: usize,
    offset: impl Fn(usize, usize) -> usize,
) -> Option<Vec<[f32; 3]>> {
    let float = |at: usize| Some(f32::from_le_bytes(data.get(at..at + 4)?.try_into().ok()?));
    (0..pixels)
        .map(|pixel| {
            Some([float(offset(pixel, 0))?, float(offset(pixel, 1))?, float(offset(pixel, 2))?])
        })
        .collect()
}
