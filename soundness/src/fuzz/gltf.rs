//! Valid glTF models with everything that their reader knows.

use std::{io::Cursor, sync::LazyLock};

use image::{DynamicImage, ImageFormat, Rgb, RgbImage, Rgba, RgbaImage};

mod damage;

pub(super) use damage::{damaged_binary, damaged_text};

/// A model in parts.
#[derive(Clone)]
pub(super) struct Model {
    /// JSON without its buffer's address: [`ADDRESS`] stands there.
    json: Vec<u8>,
    /// The contents of the only buffer.
    pub bytes: Vec<u8>,
}

/// What stands in place of the address of the buffer, so that damage to numbers does not meet the digits of its bytes.
const ADDRESS: &str = r#""uri":"@","#;

/// The file beside a model in text.
pub(super) const BESIDE: &str = "m.bin";

/// Models of every kind.
static MODELS: LazyLock<[Model; 2]> = LazyLock::new(|| [rich(), small()]);

/// Valid binary files.
pub(super) static BINARY: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| MODELS.iter().map(binary).collect());

/// Valid text files: with their bytes inside, and in [`BESIDE`].
pub(super) static TEXT: LazyLock<Vec<Vec<u8>>> =
    LazyLock::new(|| MODELS.iter().map(inside).chain([beside(&MODELS[0])]).collect());

/// The contents of [`BESIDE`].
pub(super) fn file_beside() -> &'static [u8] {
    &MODELS[0].bytes
}

/// Accessors and views while a model is written.
#[derive(Default)]
struct Writer {
    bytes: Vec<u8>,
    views: Vec<String>,
    accessors: Vec<String>,
}

impl Writer {
    fn view(&mut self, bytes: &[u8], more: &str) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let (offset, length) = (self.bytes.len(), bytes.len());
        self.views.push(format!(r#"{{"buffer":0,"byteOffset":{offset},"byteLength":{length}{more}}}"#));
        self.bytes.extend(bytes);
        self.views.len() - 1
    }

    /// An accessor; `kind` is the type and the component type.
    fn accessor(&mut self, view: usize, count: usize, kind: (&str, u32), more: &str) -> usize {
        let (kind, component) = kind;
        self.accessors.push(format!(
            r#"{{"bufferView":{view},"byteOffset":0,"count":{count},"type":"{kind}","componentType":{component}{more}}}"#
        ));
        self.accessors.len() - 1
    }

    fn floats<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        let view = self.view(&bytes_of(values.as_flattened()), "");
        let kind = ["", "SCALAR", "VEC2", "VEC3", "VEC4"][N];
        let more = if N == 3 { r#","min":[-1,-1,-1],"max":[2,2,2]"# } else { "" };
        self.accessor(view, values.len(), (kind, 5126), more)
    }

    fn model(self, parts: &str) -> Model {
        let json = format!(
            r#"{{"asset":{{"version":"2.0"}},"buffers":[{{{ADDRESS}"byteLength":{}}}],"bufferViews":[{}],"accessors":[{}],{parts}}}"#,
            self.bytes.len(),
            self.views.join(","),
            self.accessors.join(",")
        );
        Model { json: json.into_bytes(), bytes: self.bytes }
    }
}

fn bytes_of(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

fn encoded(image: impl Into<DynamicImage>, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.into().write_to(&mut bytes, format).expect("a small image is written to memory");
    bytes.into_inner()
}

/// A square of all that meshes and materials may have, animated, with cameras and lights.
fn rich() -> Model {
    let mut w = Writer::default();
    let square = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0_f32]];
    let plain = w.floats(&square);
    let normals = w.floats(&[[0.0, 0.0, 1.0]; 4]);
    let uvs = w.floats(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
    // Positions and normals in turn.
    let both: Vec<f32> = square.iter().flat_map(|p| [p[0], p[1], p[2], 0.0, 0.6, 0.8]).collect();
    let view = w.view(&bytes_of(&both), r#","byteStride":24,"target":34962"#);
    let strided = w.accessor(view, 4, ("VEC3", 5126), r#","min":[0,0,0],"max":[1,1,0]"#);
    // Small whole numbers: positions, coordinates, colours and indices.
    let packed: Vec<u8> =
        [0_i16, 0, 0, 0, 9, 0, 0, 0, 9, 9, 0, 0, 0, 9, 3, 0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let view = w.view(&packed, r#","byteStride":8"#);
    let quantized = w.accessor(view, 4, ("VEC3", 5122), r#","min":[0,0,0],"max":[9,9,3]"#);
    let view = w.view(&[0, 0, 255, 0, 255, 255, 0, 255], "");
    let small_uvs = w.accessor(view, 4, ("VEC2", 5121), r#","normalized":true"#);
    let view = w.view(&[255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 9, 9, 9, 0], "");
    let colours = w.accessor(view, 4, ("VEC4", 5121), r#","normalized":true"#);
    let view = w.view(&[0, 1, 2, 0, 2, 3], r#","target":34963"#);
    let bytes = w.accessor(view, 6, ("SCALAR", 5121), "");
    let view = w.view(&[0, 0, 1, 0, 3, 0, 2, 0], r#","target":34963"#);
    let shorts = w.accessor(view, 4, ("SCALAR", 5123), "");
    // Elements that replace others, and elements that replace zeros.
    let (at, by) = (w.view(&[1, 2], ""), w.view(&bytes_of(&[2.0, 0.0, 0.5, 0.0, 2.0, 0.5]), ""));
    let replaced = format!(
        r#""sparse":{{"count":2,"indices":{{"bufferView":{at},"byteOffset":0,"componentType":5121}},"values":{{"bufferView":{by},"byteOffset":0}}}}"#
    );
    w.accessors.push(format!(
        r#"{{"bufferView":0,"count":4,"type":"VEC3","componentType":5126,"min":[0,0,0],"max":[2,2,1],{replaced}}}"#
    ));
    w.accessors
        .push(format!(r#"{{"count":4,"type":"VEC3","componentType":5126,"min":[0,0,0],"max":[2,2,1],{replaced}}}"#));
    let (sparse, zeros) = (w.accessors.len() - 2, w.accessors.len() - 1);
    let png = encoded(
        RgbaImage::from_fn(4, 2, |x, y| Rgba([90, 60, (50 * x) as u8, if x == y { 0 } else { 255 }])),
        ImageFormat::Png,
    );
    let jpeg = encoded(RgbImage::from_fn(8, 8, |x, y| Rgb([(30 * x) as u8, (30 * y) as u8, 9])), ImageFormat::Jpeg);
    let webp = encoded(RgbaImage::from_fn(4, 4, |x, y| Rgba([(9 * x * y) as u8, 2, 3, 255])), ImageFormat::WebP);
    let [png, jpeg, webp] = [png, jpeg, webp].map(|bytes| w.view(&bytes, ""));
    let times = w.floats(&[[0.0], [0.1], [0.2_f32]]);
    let places = w.floats(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]);
    let turns = w.floats(&[[0.0, 0.0, 0.0, 1.0], [0.0, 0.7, 0.0, 0.7], [0.0, 1.0, 0.0, 0.0]]);
    let sizes = w.floats(&[[1.0, 1.0, 1.0], [2.0, 1.0, 1.0], [1.0, 2.0, 3.0]]);
    let tangents: Vec<[f32; 3]> = (0..9).map(|i| [0.1 * i as f32, 0.0, 0.5]).collect();
    let tangents = w.floats(&tangents);
    let material = |name: &str, more: &str| format!(r#"{{"name":"{name}",{more}}}"#);
    let materials = [
        material(
            "full",
            r#""pbrMetallicRoughness":{"baseColorFactor":[0.8,0.7,0.6,0.9],"baseColorTexture":{"index":0,"texCoord":0,"extensions":{"KHR_texture_transform":{"offset":[0.5,0.25],"rotation":0.3,"scale":[2,3],"texCoord":0}}},"metallicFactor":0.5,"roughnessFactor":0.4,"metallicRoughnessTexture":{"index":1}},"normalTexture":{"index":1,"scale":0.5},"occlusionTexture":{"index":1,"strength":0.5},"alphaMode":"MASK","alphaCutoff":0.4,"doubleSided":true"#,
        ),
        material(
            "lamp",
            r#""emissiveFactor":[1,0.5,0.25],"emissiveTexture":{"index":1},"extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":5.5},"KHR_materials_ior":{"ior":1.4}}"#,
        ),
        material(
            "old",
            r#""alphaMode":"BLEND","extensions":{"KHR_materials_pbrSpecularGlossiness":{"diffuseFactor":[0.5,0.5,0.5,0.5],"diffuseTexture":{"index":2},"specularFactor":[0.2,0.2,0.2],"glossinessFactor":0.7}}"#,
        ),
        material("flat", r#""pbrMetallicRoughness":{"baseColorFactor":[1,1,1,1]},"extensions":{"KHR_materials_unlit":{}}"#),
    ]
    .join(",");
    let mesh = |primitives: &[String]| format!(r#"{{"primitives":[{}]}}"#, primitives.join(","));
    let primitive = |attributes: &str, more: &str| format!(r#"{{"attributes":{{{attributes}}}{more}}}"#);
    let meshes = [
        mesh(&[
            primitive(
                &format!(r#""POSITION":{plain},"NORMAL":{normals},"TEXCOORD_0":{uvs}"#),
                &format!(r#","indices":{bytes},"material":0,"mode":4,"targets":[{{"POSITION":{plain}}}]"#),
            ),
            primitive(
                &format!(r#""POSITION":{strided},"TEXCOORD_0":{small_uvs}"#),
                &format!(r#","indices":{shorts},"material":1,"mode":5"#),
            ),
        ]),
        mesh(&[
            primitive(&format!(r#""POSITION":{quantized},"COLOR_0":{colours}"#), r#","material":3,"mode":6"#),
            primitive(&format!(r#""POSITION":{sparse},"TEXCOORD_0":{uvs}"#), r#","material":2,"mode":6"#),
            primitive(&format!(r#""POSITION":{zeros}"#), r#","mode":6"#),
            primitive(&format!(r#""POSITION":{plain}"#), r#","mode":1"#),
        ]),
    ]
    .join(",");
    let channel = |sampler: usize, node: usize, path: &str| {
        format!(r#"{{"sampler":{sampler},"target":{{"node":{node},"path":"{path}"}}}}"#)
    };
    let channels = [
        channel(0, 1, "translation"),
        channel(1, 2, "rotation"),
        channel(2, 2, "scale"),
        channel(3, 4, "translation"),
        channel(4, 5, "rotation"),
    ]
    .join(",");
    let sampler =
        |output: usize, kind: &str| format!(r#"{{"input":{times},"output":{output},"interpolation":"{kind}"}}"#);
    let samplers = [
        sampler(places, "LINEAR"),
        sampler(turns, "LINEAR"),
        sampler(sizes, "STEP"),
        sampler(tangents, "CUBICSPLINE"),
        sampler(turns, "STEP"),
    ]
    .join(",");
    w.model(&format!(
        r#""scene":0,"scenes":[{{"nodes":[0,4]}}],
"nodes":[{{"name":"root","children":[1,3],"scale":[1,2,1]}},{{"mesh":0,"children":[2],"translation":[0,0.5,0],"rotation":[0,0,0,1],"scale":[1,1,1]}},{{"mesh":1,"name":"part","translation":[0.1,0,1]}},{{"mesh":1,"matrix":[1,0,0,0,0,-1,0,0,0,0,1,0,3,0,0,1]}},{{"camera":0,"translation":[0,1,6],"children":[5]}},{{"extensions":{{"KHR_lights_punctual":{{"light":0}}}},"children":[6,7]}},{{"camera":1,"extensions":{{"KHR_lights_punctual":{{"light":1}}}}}},{{"extensions":{{"KHR_lights_punctual":{{"light":2}}}},"translation":[1,1,1]}}],
"cameras":[{{"type":"perspective","perspective":{{"yfov":0.9,"znear":0.1,"zfar":100,"aspectRatio":1.5}}}},{{"type":"orthographic","orthographic":{{"xmag":1,"ymag":1,"znear":0.1,"zfar":9}}}}],
"extensionsUsed":["KHR_lights_punctual","KHR_texture_transform","KHR_mesh_quantization"],"extensionsRequired":["KHR_mesh_quantization"],
"extensions":{{"KHR_lights_punctual":{{"lights":[{{"type":"spot","color":[1,0.5,0.2],"intensity":40,"range":9,"spot":{{"innerConeAngle":0.3,"outerConeAngle":0.6}}}},{{"type":"directional","intensity":3.5}},{{"type":"point","color":[0.5,0.5,1],"intensity":12}}]}}}},
"meshes":[{meshes}],
"materials":[{materials}],
"textures":[{{"source":0,"sampler":0}},{{"source":1}},{{"source":0,"extensions":{{"EXT_texture_webp":{{"source":2}}}}}}],
"samplers":[{{"magFilter":9729,"minFilter":9987,"wrapS":33071,"wrapT":10497}}],
"images":[{{"bufferView":{png},"mimeType":"image/png"}},{{"bufferView":{jpeg},"mimeType":"image/jpeg","name":"photo"}},{{"bufferView":{webp},"mimeType":"image/webp"}}],
"animations":[{{"channels":[{channels}],"samplers":[{samplers}]}}]"#
    ))
}

/// One triangle: damage often leaves it valid in most respects.
fn small() -> Model {
    let mut w = Writer::default();
    let positions = w.floats(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let view = w.view(&[0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0], "");
    let indices = w.accessor(view, 3, ("SCALAR", 5125), "");
    let times = w.floats(&[[0.0], [0.5_f32]]);
    let places = w.floats(&[[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]]);
    w.model(&format!(
        r#""nodes":[{{"mesh":0}},{{"camera":0,"translation":[0,0,4]}}],
"cameras":[{{"type":"perspective","perspective":{{"yfov":1,"znear":1}}}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":{positions}}},"indices":{indices}}}]}}],
"animations":[{{"channels":[{{"sampler":0,"target":{{"node":0,"path":"translation"}}}},{{"sampler":0,"target":{{"node":1,"path":"translation"}}}}],"samplers":[{{"input":{times},"output":{places}}}]}}]"#
    ))
}

fn with_address(json: &[u8], address: &str) -> Vec<u8> {
    let text = String::from_utf8_lossy(json);
    // Damaged JSON may have lost its place.
    text.replacen(ADDRESS, address, 1).into_bytes()
}

/// A binary file of two chunks, whose lengths are right.
fn binary(model: &Model) -> Vec<u8> {
    let padded = |bytes: &[u8], fill: u8| {
        let mut bytes = bytes.to_vec();
        bytes.resize(bytes.len().next_multiple_of(4), fill);
        bytes
    };
    let (json, bytes) = (padded(&with_address(&model.json, ""), b' '), padded(&model.bytes, 0));
    let chunk = |kind: &[u8], bytes: &[u8]| [&(bytes.len() as u32).to_le_bytes()[..], kind, bytes].concat();
    let chunks = [chunk(b"JSON", &json), chunk(b"BIN\0", &bytes)].concat();
    [b"glTF", &2_u32.to_le_bytes()[..], &(12 + chunks.len() as u32).to_le_bytes(), &chunks].concat()
}

/// A text file with its bytes inside.
fn inside(model: &Model) -> Vec<u8> {
    let data = data_encoding::BASE64.encode(&model.bytes);
    with_address(&model.json, &format!(r#""uri":"data:application/octet-stream;base64,{data}","#))
}

/// A text file whose bytes are in [`BESIDE`].
fn beside(model: &Model) -> Vec<u8> {
    with_address(&model.json, &format!(r#""uri":"{BESIDE}","#))
}
