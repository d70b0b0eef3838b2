//! The order of a tile's pixels.

/// Side of the blocks that packets lie on, in pixels.
pub const BLOCK: u32 = 16;

/// A pixel's position relative to the tile's corner, and its row of the film.
#[derive(Clone, Copy)]
pub struct Spot {
    pub x: u32,
    pub y: u32,
    pub row: u32,
}

/// Lists a tile's pixels block by block, each block in Morton order.
pub fn morton_order((width, height): (u32, u32)) -> Vec<Spot> {
    let mut order = Vec::with_capacity((width * height) as usize);
    for block_y in (0..height).step_by(BLOCK as usize) {
        for block_x in (0..width).step_by(BLOCK as usize) {
            for code in 0..BLOCK * BLOCK {
                let x = block_x + every_second_bit(code);
                let y = block_y + every_second_bit(code >> 1);
                if x < width && y < height {
                    let row = y * width + x;
                    order.push(Spot { x, y, row });
                }
            }
        }
    }
    order
}

/// Packs bits 0, 2, 4 and 6 together.
pub fn every_second_bit(code: u32) -> u32 {
    code & 1 | code >> 1 & 2 | code >> 2 & 4 | code >> 3 & 8
}
