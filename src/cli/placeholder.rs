//! A gradient in place of a picture, until the renderer is joined on. It obeys
//! the contract of the renderer: tiles, ray counts, `cancel`.

use crate::render::{Picture, Progress, RenderConfig};

const ROWS: usize = 16;

/// `None` where it was cancelled.
pub fn gradient(config: &RenderConfig, progress: &Progress) -> Option<Picture> {
    let (w, h) = (config.width as usize, config.height as usize);
    let n = w * h;
    let aovs = config.aovs;
    let mut picture = Picture {
        width: config.width,
        height: config.height,
        color: vec![[0.0; 3]; n],
        depth: aovs.depth.then(|| vec![f32::INFINITY; n]),
        position: aovs.position.then(|| vec![[0.0; 3]; n]),
        normal: aovs.normal.then(|| vec![[0.0; 3]; n]),
        albedo: aovs.albedo.then(|| vec![[0.0; 3]; n]),
        instance_id: aovs.instance_id.then(|| vec![Picture::NO_ID; n]),
        primitive_id: aovs.primitive_id.then(|| vec![u32::MAX; n]),
    };
    progress.start(h.div_ceil(ROWS) as u32);
    for (tile, rows) in picture.color.chunks_mut(w * ROWS).enumerate() {
        for (i, rgb) in rows.iter_mut().enumerate() {
            let (x, y) = (i % w, tile * ROWS + i / w);
            // As slow as the samples asked for, so that it can be interrupted.
            for _ in 0..config.spp {
                *rgb = std::hint::black_box([x as f32 / w as f32, y as f32 / h as f32, 0.2]);
            }
            if i % w == 0 && progress.is_cancelled() {
                return None;
            }
        }
        progress.add_tile(rows.len() as u64 * u64::from(config.spp));
    }
    Some(picture)
}
