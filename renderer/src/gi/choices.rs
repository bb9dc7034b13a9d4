//! Choices that several techniques have in common.

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
    /// Where light comes from.
    pub enum Sources {
        /// Nearby from the screen, from farther away from the lights' views.
        Both = "both",
        /// From the screen alone, within the radius.
        Screen = "screen",
        /// From the lights' views alone, at any distance.
        Lights = "lights",
    }
}

choice! {
    /// How a sample is weighted.
    pub enum Weighting {
        /// As printed: a mean without units, made brighter by one intensity.
        Published = "published",
        /// As the area that it stands for: absolute units.
        Radiometric = "radiometric",
    }
}

choice! {
    /// What a technique finds.
    pub enum Finds {
        /// Indirect light, and with it that of the environment through what is open.
        Light = "light",
        /// Openness alone, as the output `ambient_occlusion`.
        Occlusion = "occlusion",
    }
}

choice! {
    /// How steps are spread along a side of a slice.
    pub enum Spacing {
        /// Evenly.
        Constant = "constant",
        /// Each longer than the last by the same factor: nearby surfaces get more of them.
        Exponential = "exponential",
    }
}

choice! {
    /// Resolution of the gather, relative to the display.
    pub enum Resolution {
        /// Every pixel.
        Full = "full",
        /// Half of width and height, brought back by joint bilateral upsampling.
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
        /// Half the bytes; relative error 5e-4, values over 65,504 are clamped.
        Float16 = "float16",
        /// Nothing is lost.
        Float32 = "float32",
    }
}
