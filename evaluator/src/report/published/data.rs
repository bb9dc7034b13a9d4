//! The tables themselves: sources, steps and claims of the papers, with the figures in `evaluator/published`.

use super::{Claim, PublishedTable, Share};

const fn claim(name: &'static str, step: &'static str, of: usize, over: usize) -> Claim {
    Claim { name, step, of, over, over_step: step }
}

/// Two steps of one configuration.
const fn steps(name: &'static str, step: &'static str, over_step: &'static str, of: usize) -> Claim {
    Claim { name, step, of, over: of, over_step }
}

/// All tables.
pub const TABLES: [PublishedTable; 9] = [
    SOLER_2009_FIG6,
    SOLER_2010_FIG9,
    THERRIEN_2023_TABLE1,
    THERRIEN_2023_TABLE2,
    LAMBRU_TABLE1,
    LAMBRU_TABLE2,
    LAMBRU_TABLE3,
    LAMBRU_TABLE4,
    LAMBRU_TABLE5,
];

const SOLER_2009_FIG6: PublishedTable = PublishedTable {
    preset: "soler2009_fig6",
    source: "Soler, Hoel, Rochet, Jay, Holzschuch: Hierarchical Screen Space Indirect Illumination For Video Games, INRIA \
             RR-7162 (2009), Figure 6",
    remarks: "1280×720, r = 20, 3×3 upsampling kernel, no visibility, samples per level. The paper does not count the \
              making of the mipmaps, so the pyramid passes are left out here too. So are the passes of \
              a sky's light.",
    divisor: None,
    steps: &[("gather", &["gather"]), ("combine", &["combine", "upsample"]), ("composite", &["composite"])],
    // Configurations: 0 quarter 4 64, 1 quarter 4 256, 2 half 4 256, 3 half 4 64, 4 half 5 64.
    claims: &[
        claim("half start resolution over quarter, 64 samples", "gather", 3, 0),
        claim("half start resolution over quarter, 256 samples", "gather", 2, 1),
        claim("256 samples over 64, quarter", "gather", 1, 0),
        claim("256 samples over 64, half", "gather", 2, 3),
        claim("five levels over four, half, 64 samples", "gather", 4, 3),
        claim("five levels over four, half, 64 samples", "total", 4, 3),
    ],
    // Its Figure 7 and the text beside it.
    share: Some(Share {
        name: "share of the first level, half, 4 levels, 64 samples",
        step: "gather",
        pass: "gather_0",
        of: 3,
        published: "over 70 %",
    }),
    csv: include_str!("../../../published/soler2009_fig6.csv"),
};

const SOLER_2010_FIG9: PublishedTable = PublishedTable {
    preset: "soler2010_fig9",
    source: "Soler, Hoel: A Fast Deferred Shading Pipeline for Real Time Approximate Indirect Illumination, INRIA RR-7162 \
             (2010), Figure 9",
    remarks: "Sponza, 1280×720, r = 40, samples per level. The paper's combine step holds its temporal filter too. Its \
              rays test every sample; here several samples share one (`samples_per_ray`). The paper does not count the \
              making of the mipmaps, so the pyramid passes are left out here too. So are the passes of \
              a sky's light.",
    divisor: None,
    steps: &[
        ("voxels", &["depth_range", "voxelize_solid", "voxelize_surfaces", "voxels"]),
        ("gather", &["gather"]),
        ("combine", &["combine", "upsample"]),
    ],
    // Configurations, each without and then with visibility: 0 quarter 4 64, 2 quarter 4 256, 4 half 4 64, 6 half 5 64.
    claims: &[
        claim("visibility over none, quarter, 4 levels, 64 samples", "total", 1, 0),
        claim("visibility over none, quarter, 4 levels, 256 samples", "total", 3, 2),
        claim("visibility over none, half, 4 levels, 64 samples", "total", 5, 4),
        claim("visibility over none, half, 5 levels, 64 samples", "total", 7, 6),
        claim("half start resolution over quarter, no visibility", "gather", 4, 0),
        claim("half start resolution over quarter, visibility", "gather", 5, 1),
        claim("256 samples over 64, quarter, no visibility", "gather", 2, 0),
        claim("256 samples over 64, quarter, visibility", "gather", 3, 1),
        claim("five levels over four, half, no visibility", "gather", 6, 4),
        claim("five levels over four, half, visibility", "gather", 7, 5),
    ],
    share: Some(Share {
        name: "share of the first level, half, 4 levels, no visibility",
        step: "gather",
        pass: "gather_0",
        of: 4,
        published: "74 %",
    }),
    csv: include_str!("../../../published/soler2010_fig9.csv"),
};

const THERRIEN_2023: &str = "Therrien, Levesque, Gilet: Screen Space Indirect Lighting with Visibility Bitmask, Computer \
                             Graphics Forum 40-8 (2023)";

const THERRIEN_2023_TABLE1: PublishedTable = PublishedTable {
    preset: "therrien2023_table1",
    source: THERRIEN_2023,
    remarks: "Table 1: 1920×1080, one slice, 32 sectors, steps on one side, the sampling pass alone. The atrium stands in \
              for its scene.",
    divisor: None,
    steps: &[("sampling", &["gather"])],
    // Configurations: gtao and bitmask by turns, for 0.8 8, 1 12, 1 16, 2 16 and 3 16 (radius, steps).
    claims: &[
        claim("bitmask over GTAO, radius 0.8, 8 steps", "sampling", 1, 0),
        claim("bitmask over GTAO, radius 1, 12 steps", "sampling", 3, 2),
        claim("bitmask over GTAO, radius 1, 16 steps", "sampling", 5, 4),
        claim("bitmask over GTAO, radius 2, 16 steps", "sampling", 7, 6),
        claim("bitmask over GTAO, radius 3, 16 steps", "sampling", 9, 8),
        claim("16 steps over 12, bitmask", "sampling", 5, 3),
        claim("radius 2 over 1, bitmask", "sampling", 7, 5),
    ],
    share: None,
    csv: include_str!("../../../published/therrien2023_table1.csv"),
};

const THERRIEN_2023_TABLE2: PublishedTable = PublishedTable {
    preset: "therrien2023_table2",
    source: THERRIEN_2023,
    remarks: "Table 2: indirect diffuse light, 1920×1080, one slice, thickness 0.2, steps on one side. The paper's denoising \
              includes its upsampling. The atrium stands in for its scene.",
    divisor: None,
    steps: &[("sampling", &["gather"]), ("denoising", &["denoise", "upsample"])],
    // Configurations a to f of the paper.
    claims: &[
        claim("radius 4 over 1, 8 steps (b over a)", "sampling", 1, 0),
        claim("16 steps over 8, radius 4 (c over b)", "sampling", 2, 1),
        claim("exponential over constant steps (d over c)", "sampling", 3, 2),
        claim("32 steps over 16 (e over d)", "sampling", 4, 3),
        claim("half resolution over full (f over d)", "sampling", 5, 3),
        claim("half resolution over full (f over d)", "total", 5, 3),
    ],
    share: Some(Share {
        name: "share of denoising, 16 exponential steps, full resolution",
        step: "total",
        pass: "denoise_0",
        of: 3,
        published: "11 %",
    }),
    csv: include_str!("../../../published/therrien2023_table2.csv"),
};

const LAMBRU: &str = "Lambru, Morar, Moldoveanu, Asavei, Ivașcu: Hybrid Global Illumination: A Novel Approach Combining \
                      Screen and Light Space Information, U.P.B. Scientific Bulletin";

const LAMBRU_TABLE1: PublishedTable = PublishedTable {
    preset: "lambru_table1",
    source: LAMBRU,
    remarks: "Table 1: frames a second at 1280×720 and 1920×1080, here as milliseconds, at a fourth of either width; one sun, \
              patterns and weights as published, gathered at half resolution. The paper's frames hold its G-buffer, shadow, \
              specular light and occlusion too, which damps its ratios; here a frame is what diffuse light needs. The statue \
              stands in for its scene.",
    divisor: Some(4),
    steps: &[("frame", &["pyramid", "near", "light_view", "rsm", "upsample", "composite"])],
    // Configurations: 4 i + j for samples 50, 100, 150, 200 of the light's view (i) and of the screen (j); 16 more at the
    // higher resolution.
    claims: &[
        claim("100 screen samples over 50, 50 of the light", "frame", 1, 0),
        claim("150 screen samples over 50, 50 of the light", "frame", 2, 0),
        claim("200 screen samples over 50, 50 of the light", "frame", 3, 0),
        claim("100 light samples over 50, 50 of the screen", "frame", 4, 0),
        claim("150 light samples over 50, 50 of the screen", "frame", 8, 0),
        claim("200 light samples over 50, 50 of the screen", "frame", 12, 0),
        claim("200 of both over 50", "frame", 15, 0),
        claim("the higher resolution, 50 of both", "frame", 16, 0),
        claim("the higher resolution, 200 of both", "frame", 31, 15),
    ],
    share: None,
    csv: include_str!("../../../published/lambru_table1.csv"),
};

const LAMBRU_TABLE2: PublishedTable = PublishedTable {
    preset: "lambru_table2",
    source: LAMBRU,
    remarks: "Table 2: the two diffuse passes alone, 1280×720 and 1920×1080, here at a fourth of either width; one sun, \
              patterns and weights as published, gathered at half resolution. The statue stands in for its scene.",
    divisor: Some(4),
    steps: &[("rsm", &["rsm"]), ("ssdo", &["near"])],
    // Configurations: samples 50, 100, 150, 200; four more at the higher resolution.
    claims: &[
        claim("100 samples over 50", "rsm", 1, 0),
        claim("150 samples over 50", "rsm", 2, 0),
        claim("200 samples over 50", "rsm", 3, 0),
        claim("100 samples over 50", "ssdo", 1, 0),
        claim("150 samples over 50", "ssdo", 2, 0),
        claim("200 samples over 50", "ssdo", 3, 0),
        claim("the higher resolution, 100 samples", "rsm", 5, 1),
        claim("the higher resolution, 100 samples", "ssdo", 5, 1),
        steps("SSDO over RSM, 50 samples", "ssdo", "rsm", 0),
        steps("SSDO over RSM, 200 samples", "ssdo", "rsm", 3),
        steps("SSDO over RSM, 200 samples, the higher resolution", "ssdo", "rsm", 7),
    ],
    share: None,
    csv: include_str!("../../../published/lambru_table2.csv"),
};

const LAMBRU_TABLE3: PublishedTable = PublishedTable {
    preset: "lambru_table3",
    source: LAMBRU,
    remarks: "Table 3: the intersection map of the screen, and the pass that marches in the light's view where it is empty \
              and combines both, 1280×720 and 1920×1080, here at a fourth of either width. Steps are two pixels, or two texels \
              of a light's view of 256 texels, apart. The statue on its polished floor stands in for the paper's scene.",
    divisor: Some(4),
    steps: &[("intersections", &["mirror_map"]), ("specular", &["specular"])],
    claims: &[
        claim("the higher resolution", "intersections", 1, 0),
        claim("the higher resolution", "specular", 1, 0),
        steps("the light's view and both over the map", "specular", "intersections", 0),
        steps("the same at the higher resolution", "specular", "intersections", 1),
    ],
    share: None,
    csv: include_str!("../../../published/lambru_table3.csv"),
};

const LAMBRU_TABLE4: PublishedTable = PublishedTable {
    preset: "lambru_table4",
    source: LAMBRU,
    remarks: "Table 4: ambient occlusion from the light's view and from the screen, 32 samples each, 1280×720 and 1920×1080, \
              here at a fourth of either width. The statue stands in for its scene.",
    divisor: Some(4),
    steps: &[("rsm", &["occlusion_0"]), ("screen", &["occlusion_screen"])],
    claims: &[
        claim("the higher resolution", "rsm", 1, 0),
        claim("the higher resolution", "screen", 1, 0),
        steps("screen over light's view", "screen", "rsm", 0),
        steps("the same at the higher resolution", "screen", "rsm", 1),
    ],
    share: None,
    csv: include_str!("../../../published/lambru_table4.csv"),
};

const LAMBRU_TABLE5: PublishedTable = PublishedTable {
    preset: "lambru_table5",
    source: LAMBRU,
    remarks: "Table 5: the original techniques, frames a second at 1280×720 and 1920×1080, here as milliseconds, at a fourth of \
              either width; radii 3 and 30 of the paper are 0.15 and 1.5 m here. The paper's frames hold G-buffer, shadow and \
              ambient occlusion too, which damps its ratios; here a frame is what the technique needs. The statue stands in for \
              its scene.",
    divisor: Some(4),
    steps: &[("frame", &["pyramid", "gather", "light_view", "rsm", "upsample", "composite"])],
    // Configurations: 3 i + j for 50, 100, 150, 200 samples (i) and RSM, SSDO of the small and of the large radius (j); twelve
    // more at the higher resolution.
    claims: &[
        claim("RSM, 200 samples over 50", "frame", 9, 0),
        claim("SSDO, small radius, 200 samples over 50", "frame", 10, 1),
        claim("SSDO, large radius, 200 samples over 50", "frame", 11, 2),
        claim("large radius over small, SSDO, 100 samples", "frame", 5, 4),
        claim("SSDO, small radius, over RSM, 100 samples", "frame", 4, 3),
        claim("the higher resolution, RSM, 100 samples", "frame", 15, 3),
        claim("the higher resolution, SSDO, small radius, 100 samples", "frame", 16, 4),
    ],
    share: None,
    csv: include_str!("../../../published/lambru_table5.csv"),
};
