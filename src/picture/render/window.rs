//! Windows: rectangles of a picture that are rendered alone, with the bits that the whole has there.

use super::pixel_order::BLOCK;

/// A rectangle of a picture's pixels. It begins at a multiple of [`Window::STEP`], so that it cuts
/// no tile and no packet of rays that the whole picture has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Of its left upper pixel.
    pub x: u32,
    pub y: u32,
    pub width: u32,
    pub height: u32,
}

impl Window {
    /// Side of the largest tile, in pixels.
    pub const STEP: u32 = 2 * BLOCK;

    /// Returns the window of a whole picture.
    pub fn whole(width: u32, height: u32) -> Window {
        Window {
            x: 0,
            y: 0,
            width,
            height,
        }
    }

    /// Returns the most columns and rows of windows that a picture can be divided into.
    pub fn most(width: u32, height: u32) -> (u32, u32) {
        (width.div_ceil(Window::STEP), height.div_ceil(Window::STEP))
    }

    /// Returns one of the windows of a grid of columns and rows, numbered row by row; `None` if
    /// there is none of this number, or the picture has too few pixels for the grid.
    pub fn of_grid((width, height): (u32, u32), grid: (u32, u32), number: u32) -> Option<Window> {
        let most = Window::most(width, height);
        if grid.0 == 0 || grid.0 > most.0 || grid.1 > most.1 || number / grid.0 >= grid.1 {
            return None;
        }
        let side = |number: u32, parts: u32, steps: u32, pixels: u32| {
            let end = |number: u32| u64::from(steps) * u64::from(number) / u64::from(parts);
            let [first, end] = [number, number + 1].map(|n| end(n) as u32 * Window::STEP);
            (first, end.min(pixels) - first)
        };
        let (x, width) = side(number % grid.0, grid.0, most.0, width);
        let (y, height) = side(number / grid.0, grid.1, most.1, height);
        Some(Window {
            x,
            y,
            width,
            height,
        })
    }

    /// Says whether this is a window of a picture of some size.
    pub fn lies_in(&self, width: u32, height: u32) -> bool {
        let within = |start: u32, len: u32, whole: u32| {
            let end = start.checked_add(len);
            len > 0 && start.is_multiple_of(Window::STEP) && end.is_some_and(|end| end <= whole)
        };
        within(self.x, self.width, width) && within(self.y, self.height, height)
    }

    /// Returns the number of its pixels.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Returns the position in the window of a pixel of the picture, which lies in it.
    pub fn local(&self, (x, y): (u32, u32)) -> (u32, u32) {
        (x - self.x, y - self.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_of_a_grid_cover_each_pixel_once() {
        for (size, grid) in [
            ((100, 70), (4, 3)),
            ((128, 128), (4, 4)),
            ((1280, 720), (3, 7)),
            ((1, 1), (1, 1)),
        ] {
            let mut met = vec![0; (size.0 * size.1) as usize];
            for number in 0..grid.0 * grid.1 {
                let window = Window::of_grid(size, grid, number).unwrap();
                assert!(
                    window.x.is_multiple_of(Window::STEP) && window.y.is_multiple_of(Window::STEP)
                );
                for y in window.y..window.y + window.height {
                    let row = (y * size.0 + window.x) as usize;
                    let row = &mut met[row..row + window.width as usize];
                    row.iter_mut().for_each(|times| *times += 1);
                }
            }
            assert!(met.iter().all(|times| *times == 1), "{size:?} {grid:?}");
            assert_eq!(Window::of_grid(size, grid, grid.0 * grid.1), None);
        }
        assert_eq!(Window::of_grid((100, 70), (5, 1), 0), None);
        assert_eq!(Window::of_grid((100, 70), (0, 1), 0), None);
    }
}
