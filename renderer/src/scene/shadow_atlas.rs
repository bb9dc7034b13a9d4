//! How the shadow maps of all lights share a texture.

use halflight_frame_graph::Tile;

use crate::parameters::SettingsError;

/// Bytes that all shadow maps may take. 16 maps of the default size fit: those of every scene with up to two point lights
/// and four others.
pub const BUDGET: u64 = 1 << 30;
/// Bytes of a texel.
const TEXEL: u64 = 4;
/// Layers that every device allows.
const MOST_LAYERS: u32 = 256;
/// Smallest width of a map, texels: that of the setting.
const SMALLEST: u32 = 64;

/// The shadow maps in a texture: one map in a layer, as wide as the setting asks for, or if they do not fit, smaller ones
/// in square tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShadowAtlas {
    /// Number of maps.
    pub maps: u32,
    /// Width and height of a map, texels.
    pub map_size: u32,
    /// Maps along each side of a layer.
    pub per_side: u32,
}

impl ShadowAtlas {
    /// The largest maps, at most `wanted` texels wide, that fit the budget; `None` if not even the smallest do.
    pub fn new(maps: u32, wanted: u32) -> Option<Self> {
        // As few maps in a layer as the number of layers allows: some devices load a whole layer to draw one of its tiles.
        let per_side = f64::from(maps.div_ceil(MOST_LAYERS)).sqrt().ceil() as u32;
        let atlas = Self { maps, map_size: wanted, per_side: per_side.max(1) };
        let of_map = BUDGET / (TEXEL * u64::from(atlas.layers()) * u64::from(atlas.per_side).pow(2));
        let largest = of_map.isqrt().min(wanted.into()) as u32;
        (largest >= SMALLEST.min(wanted)).then_some(Self { map_size: largest, ..atlas })
    }

    /// As [`ShadowAtlas::new`].
    ///
    /// # Errors
    /// If not even the smallest maps fit.
    pub fn of_lights(maps: u32, wanted: u32, lights: usize) -> Result<Self, SettingsError> {
        Self::new(maps, wanted).ok_or_else(|| {
            SettingsError(format!(
                "{lights} lights need {maps} shadow maps and at most {} fit {} MiB: use fewer lights (a point light has six \
                 maps)",
                Self::most_maps(),
                BUDGET >> 20
            ))
        })
    }

    /// The largest number of maps that fit.
    fn most_maps() -> u64 {
        BUDGET / TEXEL / u64::from(SMALLEST).pow(2)
    }

    /// Width and height of a layer, texels.
    pub fn layer_size(&self) -> u32 {
        self.per_side * self.map_size
    }

    /// Number of layers.
    pub fn layers(&self) -> u32 {
        self.maps.div_ceil(self.per_side * self.per_side).max(1)
    }

    /// Bytes of the texture.
    pub fn bytes(&self) -> u64 {
        u64::from(self.layer_size()).pow(2) * u64::from(self.layers()) * TEXEL
    }

    /// Layer of a map, and its part of the layer; `None` if it is the whole layer.
    pub fn place(&self, map: u32) -> (u32, Option<Tile>) {
        let of_layer = self.per_side * self.per_side;
        let index = map % of_layer;
        let corner = [index % self.per_side, index / self.per_side].map(|v| v * self.map_size);
        (map / of_layer, (self.per_side > 1).then_some(Tile { corner, size: self.map_size }))
    }

    /// A sentence if maps are smaller than `wanted`.
    pub fn note(&self, wanted: u32) -> Option<String> {
        (self.map_size < wanted).then(|| {
            format!(
                "shadow maps are {0}x{0} texels instead of {wanted}x{wanted}, because {1} maps share {2} MiB",
                self.map_size,
                self.maps,
                BUDGET >> 20
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn atlas(maps: u32, wanted: u32) -> ShadowAtlas {
        ShadowAtlas::new(maps, wanted).expect("they fit")
    }

    #[test]
    fn few_maps_are_as_large_as_asked() {
        for (maps, wanted) in [(1, 4096), (15, 4096), (16, 4096), (1, 8192), (4, 8192), (256, 1024), (7, 64)] {
            let atlas = atlas(maps, wanted);
            assert_eq!(atlas, ShadowAtlas { maps, map_size: wanted, per_side: 1 });
            assert_eq!((atlas.layers(), atlas.place(maps - 1)), (maps, (maps - 1, None)));
            assert_eq!(atlas.note(wanted), None);
        }
    }

    #[test]
    fn many_maps_share_the_budget() {
        // Point lights have six maps: 3, 43, 64, 1000 of them; 257 and 1000 suns.
        for (maps, least) in [(18, 3800), (258, 1000), (384, 830), (6000, 210), (257, 1000), (1000, 510), (65536, 64)] {
            let atlas = atlas(maps, 4096);
            assert!(atlas.map_size >= least && atlas.map_size < 4096, "{atlas:?}");
            assert!(atlas.bytes() <= BUDGET && atlas.bytes() > BUDGET / 100 * 98, "{atlas:?}");
            assert!(atlas.layers() <= 256 && atlas.layer_size() <= 4096, "{atlas:?}");
            assert!(atlas.note(4096).is_some_and(|note| note.contains(&atlas.map_size.to_string())));
        }
        assert_eq!(ShadowAtlas::new(65537, 4096), None);
        let refused = ShadowAtlas::of_lights(66000, 4096, 11000).expect_err("too many").to_string();
        assert!(refused.contains("11000 lights") && refused.contains("65536"), "{refused}");
    }

    #[test]
    fn more_maps_than_layers_keep_a_size_that_fits() {
        let atlas = atlas(257, 512);
        assert_eq!((atlas.map_size, atlas.per_side), (512, 2));
        assert_eq!(atlas.note(512), None);
        // Four in each layer.
        assert_eq!(atlas.layers(), 65);
        assert_eq!(atlas.place(7), (1, Some(Tile { corner: [512, 512], size: 512 })));
        assert_eq!(atlas.place(256), (64, Some(Tile { corner: [0, 0], size: 512 })));
    }

    #[test]
    fn no_two_maps_overlap() {
        for (maps, wanted) in [(384, 4096), (300, 64), (1000, 900), (17, 4096)] {
            let atlas = atlas(maps, wanted);
            let places: std::collections::BTreeSet<_> = (0..maps)
                .map(|map| {
                    let (layer, tile) = atlas.place(map);
                    let corner = tile.map_or([0; 2], |tile| tile.corner);
                    assert!(layer < atlas.layers());
                    assert!(
                        corner.iter().all(|&v| v + atlas.map_size <= atlas.layer_size() && v % atlas.map_size == 0)
                    );
                    (layer, corner)
                })
                .collect();
            assert_eq!(places.len(), maps as usize);
        }
    }
}
