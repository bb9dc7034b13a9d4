//! Choices that several techniques share.

use super::{LightSources, Reach};
use crate::choice;

choice! {
    /// A switch.
    pub enum Switch {
        /// No.
        Off = "off",
        /// Yes.
        On = "on",
    }
}

choice! {
    /// Resolution of level 0, relative to the display.
    pub enum StartResolution {
        /// Every pixel.
        Full = "full",
        /// Half of width and height.
        Half = "half",
        /// A quarter of width and height.
        Quarter = "quarter",
    }
}

impl StartResolution {
    /// Width of a texel of level 0 in pixels of the display.
    pub fn divisor(self) -> u32 {
        1 << self as u32
    }
}

choice! {
    /// Domains that light comes from.
    pub enum Sources {
        /// Near light from the screen, far light from reflective shadow maps.
        Both = "both",
        /// The screen only, within the radius.
        Screen = "screen",
        /// Reflective shadow maps only, at any distance.
        Lights = "lights",
    }
}

choice! {
    /// Weighting of samples.
    pub enum Weighting {
        /// As published: a mean without units, scaled by one intensity.
        Published = "published",
        /// By the area that a sample stands for: absolute units.
        Radiometric = "radiometric",
    }
}

choice! {
    /// Result of a technique.
    pub enum Finds {
        /// Indirect light, including that of the environment through open directions.
        Light = "light",
        /// Ambient visibility alone, as the output `ambient_occlusion`.
        Occlusion = "occlusion",
    }
}

impl Finds {
    /// The sources that slices and rays on the screen take: ambient visibility alone attenuates the light of the sky.
    pub fn sources(self) -> LightSources {
        let screen = if self == Self::Light { LightSources::SCREEN } else { LightSources::NONE };
        LightSources { sky: Reach::Scene, ..screen }
    }
}

choice! {
    /// Spacing of the steps along a side of a slice.
    pub enum Spacing {
        /// Constant.
        Constant = "constant",
        /// Each step is longer than the last by a constant factor: more steps near the receiver.
        Exponential = "exponential",
    }
}

choice! {
    /// Resolution of the gather, relative to the display.
    pub enum Resolution {
        /// Every pixel.
        Full = "full",
        /// Half of width and height, with joint bilateral upsampling.
        Half = "half",
    }
}

choice! {
    /// Kernel of the joint bilateral upsampling.
    pub enum UpsamplingKernel {
        /// The texel that holds the pixel.
        Nearest = "nearest",
        /// 2x2, bilinear.
        Linear = "linear",
        /// 3x3, quadratic B-spline.
        Spline = "spline",
    }
}

choice! {
    /// Storage of the images at full resolution.
    pub enum Storage {
        /// Half the bytes. The relative error is 5e-4, and values above 65,504 are clamped.
        Float16 = "float16",
        /// Full precision.
        Float32 = "float32",
    }
}

choice! {
    /// How textures of materials are read where the camera sees them.
    pub enum TextureFilter {
        /// The mean over the pixel, from smaller copies of the texture.
        Mips = "mips",
        /// The value at the centre of the pixel, from the four nearest texels.
        Bilinear = "bilinear",
    }
}
