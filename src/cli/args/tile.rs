//! Values of `--tile`, and of the axis `tile` of jobs.

/// Columns and rows that a picture is divided into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TileGrid {
    pub columns: u32,
    pub rows: u32,
}

/// One of the tiles of a grid, numbered from 0, row by row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TileChoice {
    pub number: u32,
    pub grid: TileGrid,
}

impl TileGrid {
    /// The most columns, and rows: those of the largest picture.
    const MOST: u32 = 1 << 11;

    /// Reads `COLUMNSxROWS`, or a number of rows.
    pub fn parse(text: &str) -> Result<TileGrid, String> {
        let number = |text: &str| {
            let number = text.trim().parse().ok();
            number.filter(|n| (1..=TileGrid::MOST).contains(n))
        };
        let grid = match text.split_once('x') {
            Some((columns, rows)) => (number(columns), number(rows)),
            None => (Some(1), number(text)),
        };
        match grid {
            (Some(columns), Some(rows)) => Ok(TileGrid { columns, rows }),
            _ => Err(format!(
                "'{text}' is no grid; write columns and rows, such as 4x4, or a number of rows, each \
                 from 1 to {}",
                TileGrid::MOST
            )),
        }
    }

    /// Returns the number of its tiles.
    pub fn count(self) -> u32 {
        self.columns * self.rows
    }
}

impl TileChoice {
    /// Reads `I/COLUMNSxROWS`, or `I/ROWS`.
    pub fn parse(text: &str) -> Result<TileChoice, String> {
        let wrong = || {
            "write the number of the tile, from 0, and the grid, such as 5/4x4, or 0/3 for the first \
             of three rows"
                .to_owned()
        };
        let (number, grid) = text.split_once('/').ok_or_else(wrong)?;
        let number: u32 = number.trim().parse().map_err(|_| wrong())?;
        let grid = TileGrid::parse(grid)?;
        match number < grid.count() {
            true => Ok(TileChoice { number, grid }),
            false => Err(format!(
                "the grid has {} tiles, from 0 on; {number} is none of them",
                grid.count()
            )),
        }
    }
}

impl std::fmt::Display for TileGrid {
    fn fmt(&self, to: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(to, "{}x{}", self.columns, self.rows)
    }
}

impl std::fmt::Display for TileChoice {
    fn fmt(&self, to: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(to, "{}/{}", self.number, self.grid)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_read() {
        let of = |text| TileChoice::parse(text).map(|tile| tile.to_string());
        assert_eq!(of("5/4x4"), Ok("5/4x4".into()));
        assert_eq!(of("2/3"), Ok("2/1x3".into()));
        assert!(of("16/4x4").unwrap_err().contains("16 tiles"));
        for wrong in [
            "", "3", "-1/4", "0/0", "0/4x0", "a/4", "0/4x", "0/9999x2", "0/x",
        ] {
            assert!(of(wrong).is_err(), "{wrong}");
        }
    }
}
