//! The parts of stone, brick, timber and tile.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glam::{Affine3A, Mat3A, Vec2, Vec3, Vec3A, vec2, vec3};

use super::{ARCH, BAY, DEPTH, EAVE, HALF, Palette, SPRING, STEP, Side, UPPER, WALL};
use crate::generators::build::{BEHIND, BELOW, Builder, LEFT, MaterialId, Pen, Profile, RIGHT, placed};

/// Radius of the upper arches, two per bay, metres.
const UPPER_ARCH: f32 = 0.505;
/// Height at which the upper arches begin, metres.
const UPPER_SPRING: f32 = 7.2;
/// Thickness of the upper arcade's wall, metres.
const UPPER_WALL: f32 = 0.36;
/// Height at which the vaults of the lower galleries begin, and their rise, metres.
const VAULT: [f32; 2] = [3.62, 1.18];
/// Inner face of the outer wall in the local z of a side, metres.
const OUTER: f32 = -WALL - DEPTH;
/// Overhang of the roof into the court, metres.
const OVERHANG: f32 = 0.42;

/// One side of the court with its galleries.
pub fn side(b: &mut Builder, palette: &Palette, side: &Side) {
    lower_arcade(b, palette, side);
    upper_arcade(b, palette, side);
    corner_pier(b, palette);
    vaults(b, palette, side);
    shell(b, palette, side);
    roof(b, palette, side);
}

/// The bell tower beyond the far end.
pub fn tower(b: &mut Builder, palette: &Palette) {
    const SIZE: f32 = 6.0;
    const BELFRY: [f32; 3] = [14.2, 16.0, 18.0];
    let corner = vec3(HALF[0] + WALL + DEPTH + 1.0, 0.0, -0.5 * SIZE);
    b.frame = Affine3A::from_translation(corner);
    b.on(palette.brick).block_without(BELOW, vec3(0.0, 0.0, 0.0), vec3(SIZE, BELFRY[0], SIZE));
    for (turns, at) in [(3, [0.0, 0.0]), (2, [SIZE, 0.0]), (1, [SIZE, SIZE]), (0, [0.0, SIZE])] {
        b.frame = placed(turns, corner + vec3(at[0], 0.0, at[1]));
        let mut stone = b.on(palette.ashlar);
        // Strips at the corner and between blind panels; the corner's strip belongs to the side on its right.
        stone.block_without(BELOW, vec3(-0.08, 0.0, -0.9), vec3(0.9, BELFRY[2] + 0.2, 0.08));
        stone.block_without(BELOW, vec3(0.5 * SIZE - 0.3, 0.0, -0.3), vec3(0.5 * SIZE + 0.3, BELFRY[0] - 0.2, 0.07));
        for x in [0.9, 2.55, 4.2] {
            stone.block(vec3(x - 0.26, BELFRY[0] - 0.1, -0.52), vec3(x + 0.26, BELFRY[1], -0.02));
        }
        b.frame *= Affine3A::from_translation(vec3(0.9, 0.0, 0.0));
        let arches =
            |pitch, radius, y, z, ring| ArchedWall { count: 2, pitch, radius, y, z, ring, stones: 9, segments: 16 };
        arches(2.1, 0.74, [BELFRY[1], BELFRY[2]], [-0.04, -0.5], 0.22).draw(b, palette.brick, palette.voussoirs);
        b.frame *= Affine3A::from_translation(vec3(-0.9, 0.0, 0.0));
        let band = Profile::new(&[
            [-0.05, -0.30],
            [0.10, -0.30],
            [0.10, -0.22],
            [0.16, -0.12],
            [0.24, -0.10],
            [0.24, 0.0],
            [-0.05, 0.0],
        ]);
        for y in [11.9, BELFRY[0] + 0.02, BELFRY[2] + 0.3] {
            b.on(palette.marble).moulding(&band, [0.0, SIZE], y, 0.0, -1.0);
        }
        let peak = vec3(0.5 * SIZE, BELFRY[2] + 2.6, -0.5 * SIZE);
        let eave = [-0.5, SIZE + 0.5].map(|x| vec3(x, BELFRY[2] + 0.28, 0.5));
        let mut tiles = b.on(palette.roof_tiles);
        let uv = |p: Vec3| vec2(p.x, -1.3 * p.z);
        tiles.quad_uv([eave[0], eave[1], peak, peak], [uv(eave[0]), uv(eave[1]), uv(peak), uv(peak)]);
    }
    b.frame = Affine3A::from_translation(corner);
    let bell = Profile::new(&[
        [0.62, 0.0],
        [0.63, 0.05],
        [0.55, 0.16],
        [0.46, 0.40],
        [0.40, 0.66],
        [0.34, 0.80],
        [0.20, 0.90],
        [0.0, 0.93],
    ]);
    for z in [1.95, 4.05] {
        b.on(palette.bronze).lathe(vec3(1.4, BELFRY[1] - 0.55, z), &bell, 20);
    }
    b.on(palette.wood).block(vec3(1.25, BELFRY[1] + 0.38, -0.1), vec3(1.55, BELFRY[1] + 0.68, SIZE + 0.1));
    b.frame = Affine3A::IDENTITY;
}

/// The court's paving.
pub fn floor(b: &mut Builder, palette: &Palette) {
    let [x, z] = HALF.map(|half| half + 0.5 * WALL);
    b.on(palette.court_tiles).quad([vec3(-x, 0., z), vec3(x, 0., z), vec3(x, 0., -z), vec3(-x, 0., -z)]);
}

/// A wall from `y[0]`, where arches spring, to `y[1]`, between z = `z[0]` (front) and `z[1]` (back):
/// `count` round arches of this radius, `pitch` apart, with a ring of voussoirs on each face.
struct ArchedWall {
    count: usize,
    pitch: f32,
    radius: f32,
    y: [f32; 2],
    z: [f32; 2],
    /// Width of the ring of voussoirs, metres.
    ring: f32,
    /// Number of voussoirs, odd so that both ends and the crown are pale.
    stones: u32,
    segments: usize,
}

impl ArchedWall {
    fn draw(&self, b: &mut Builder, wall: MaterialId, voussoirs: MaterialId) {
        let (r, [spring, top]) = (self.radius, self.y);
        // The ring projects from both faces and covers the wall's edge.
        let cut = r + 0.5 * self.ring;
        for i in 0..self.count {
            let centre = (i as f32 + 0.5) * self.pitch;
            let (left, right) = (centre - 0.5 * self.pitch, centre + 0.5 * self.pitch);
            let mut edge = vec![vec2(left, spring), vec2(centre - cut, spring)];
            edge.extend((1..self.segments).map(|k| {
                let (sin, cos) = (PI * k as f32 / self.segments as f32).sin_cos();
                vec2(centre - cut * cos, spring + cut * sin)
            }));
            edge.extend([vec2(centre + cut, spring), vec2(right, spring)]);
            let mut pen = b.on(wall);
            for pair in edge.windows(2) {
                let [low0, low1] = [pair[0], pair[1]];
                let [high0, high1] = [vec2(low0.x, top), vec2(low1.x, top)];
                pen.quad([low0, low1, high1, high0].map(|p| p.extend(self.z[0])));
                pen.quad([low1, low0, high0, high1].map(|p| p.extend(self.z[1])));
            }
            let [front, back] = [self.z[0], self.z[1]];
            let ring = Profile::new(&[
                [self.ring, front - 0.02],
                [self.ring, front + 0.025],
                [self.ring * 0.8, front + 0.025],
                [self.ring * 0.8, front + 0.045],
                [0.0, front + 0.045],
                [0.0, back - 0.045],
                [self.ring, back - 0.045],
                [self.ring, back + 0.02],
            ]);
            let stations = (0..=self.segments).map(|k| {
                let turn = k as f32 / self.segments as f32;
                let (sin, cos) = (PI * turn).sin_cos();
                let radial = Vec3A::new(-cos, sin, 0.0);
                let translation = Vec3A::new(centre, spring, 0.0) + radial * r;
                let matrix3 = Mat3A::from_cols(radial, Vec3A::Z, radial.cross(Vec3A::Z));
                (Affine3A { matrix3, translation }, 0.5 * turn * self.stones as f32)
            });
            b.on(voussoirs).sweep(&ring, stations);
        }
    }
}

fn lower_arcade(b: &mut Builder, palette: &Palette, side: &Side) {
    for i in 1..side.bays {
        column(b, palette, vec3(i as f32 * BAY, STEP, -0.5 * WALL));
    }
    ArchedWall {
        count: side.bays,
        pitch: BAY,
        radius: ARCH,
        y: [SPRING, UPPER - 0.2],
        z: [0.0, -WALL],
        ring: 0.26,
        stones: 15,
        segments: 30,
    }
    .draw(b, palette.ashlar, palette.voussoirs);
    // String course under the upper floor: fillet, cyma, corona.
    let string = Profile::new(&[
        [-0.05, -0.34],
        [0.04, -0.34],
        [0.04, -0.28],
        [0.05, -0.26],
        [0.10, -0.22],
        [0.13, -0.16],
        [0.14, -0.12],
        [0.20, -0.12],
        [0.20, -0.03],
        [0.17, 0.0],
        [-0.05, 0.0],
    ]);
    b.on(palette.marble).moulding(&string, [0.0, side.length()], UPPER, 0.0, 1.0);
    // Slab between the storeys, its top slightly under that of the string course.
    ring(&mut b.on(palette.gallery_tiles), side, ENDS | BEHIND, [UPPER - 0.3, UPPER - 0.004], [OUTER - 0.2, -0.02]);
}

/// A fluted column with an attic base and two tiers of leaves; `foot` is the centre of its plinth.
fn column(b: &mut Builder, palette: &Palette, foot: Vec3) {
    let mut pen = b.on(palette.marble);
    let block = |pen: &mut Pen<'_>, half: f32, y: [f32; 2]| {
        pen.block(foot + vec3(-half, y[0], -half), foot + vec3(half, y[1], half));
    };
    block(&mut pen, 0.36, [-0.02, 0.16]);
    let base = Profile::new(&[
        [0.33, 0.15],
        [0.345, 0.175],
        [0.35, 0.205],
        [0.345, 0.235],
        [0.33, 0.26],
        [0.30, 0.265],
        [0.285, 0.285],
        [0.28, 0.315],
        [0.29, 0.335],
        [0.305, 0.34],
        [0.315, 0.36],
        [0.31, 0.385],
        [0.29, 0.40],
        [0.27, 0.405],
        [0.265, 0.43],
        [0.24, 0.44],
    ]);
    pen.lathe(foot, &base, 24);
    const FLUTES: usize = 16;
    pen.sheet(FLUTES * 4, 6, |s, t| {
        let angle = -s * TAU;
        let girth = 0.255 - 0.035 * t * t;
        // Arrises between the flutes; the flutes fade out at both ends.
        let depth = 0.022 * (t * 14.0).min((1.0 - t) * 14.0).min(1.0);
        let r = girth - depth * (0.5 - 0.5 * (angle * FLUTES as f32).cos()).sqrt();
        (foot + vec3(r * angle.cos(), 0.43 + 2.17 * t, r * angle.sin()), vec2(s * 1.5, -2.2 * t))
    });
    let bell = Profile::new(&[
        [0.20, 2.58],
        [0.245, 2.58],
        [0.25, 2.60],
        [0.245, 2.625],
        [0.215, 2.63],
        [0.215, 2.75],
        [0.225, 2.88],
        [0.25, 3.00],
        [0.29, 3.08],
        [0.315, 3.11],
    ]);
    pen.lathe(foot, &bell, 20);
    for (tier, count, rise, curl) in [(2.63, 8, 0.26, 0.09), (2.76, 8, 0.32, 0.13)] {
        for leaf in 0..count {
            let turn = TAU * (leaf as f32 + if tier > 2.7 { 0.5 } else { 0.0 }) / count as f32;
            acanthus(&mut pen, foot + Vec3::Y * tier, turn, rise, curl);
        }
    }
    block(&mut pen, 0.33, [3.10, 3.17]);
    block(&mut pen, 0.36, [3.17, SPRING - STEP - 0.07]);
    block(&mut pen, 0.38, [SPRING - STEP - 0.07, SPRING - STEP + 0.005]);
}

/// One leaf of a capital: it follows the bell, then curls outwards.
fn acanthus(pen: &mut Pen<'_>, foot: Vec3, turn: f32, rise: f32, curl: f32) {
    let (sin, cos) = turn.sin_cos();
    let (outward, across) = (vec3(cos, 0.0, sin), vec3(sin, 0.0, -cos));
    pen.sheet(4, 5, |s, t| {
        let width = 0.085 * (1.0 - 0.75 * t.powi(4));
        let x = (s - 0.5) * 2.0;
        let out = 0.225 + 0.03 * t + curl * t.powi(4) - 0.03 * x * x;
        let up = rise * (t - 0.22 * t.powi(6));
        (foot + outward * out + across * (x * width) + Vec3::Y * up, vec2(x * width, -up))
    });
}

fn upper_arcade(b: &mut Builder, palette: &Palette, side: &Side) {
    let z = [-0.04, -0.04 - UPPER_WALL];
    let middle = 0.5 * (z[0] + z[1]);
    let shaft = Profile::new(&[
        [0.11, 0.38],
        [0.125, 0.40],
        [0.125, 0.425],
        [0.11, 0.445],
        [0.095, 0.455],
        [0.105, 0.475],
        [0.10, 0.495],
        [0.085, 0.50],
        [0.083, 1.0],
        [0.075, 1.62],
        [0.088, 1.625],
        [0.09, 1.645],
        [0.078, 1.65],
        [0.08, 1.70],
        [0.10, 1.78],
        [0.135, 1.835],
        [0.14, 1.86],
    ]);
    for i in 1..2 * side.bays {
        let foot = vec3(i as f32 * 0.5 * BAY, UPPER, middle);
        let mut pen = b.on(palette.marble);
        pen.block(foot + vec3(-0.14, -0.05, -0.14), foot + vec3(0.14, 0.34, 0.14));
        pen.block(foot + vec3(-0.16, 0.34, -0.16), foot + vec3(0.16, 0.39, 0.16));
        pen.lathe(foot, &shaft, 12);
        pen.block(foot + vec3(-0.15, 1.855, -0.19), foot + vec3(0.15, 1.93, 0.19));
        pen.block(foot + vec3(-0.17, 1.93, -0.235), foot + vec3(0.17, 2.005, 0.235));
    }
    let arches = 2 * side.bays;
    ArchedWall {
        count: arches,
        pitch: 0.5 * BAY,
        radius: UPPER_ARCH,
        y: [UPPER_SPRING, EAVE - 0.2],
        z,
        ring: 0.12,
        stones: 9,
        segments: 18,
    }
    .draw(b, palette.brick, palette.voussoirs);
    let cornice = Profile::new(&[
        [-0.1, -0.55],
        [0.02, -0.55],
        [0.02, -0.47],
        [0.05, -0.44],
        [0.05, -0.34],
        [0.09, -0.30],
        [0.15, -0.24],
        [0.18, -0.17],
        [0.26, -0.17],
        [0.26, -0.04],
        [-0.1, -0.04],
    ]);
    b.on(palette.marble).moulding(&cornice, [0.0, side.length()], EAVE, -0.04, 1.0);
}

/// The pier at this side's left corner: an L of two boxes that projects from both walls, through both storeys.
fn corner_pier(b: &mut Builder, palette: &Palette) {
    let mut pen = b.on(palette.ashlar);
    let out = 0.03;
    let mut pier = |grow: f32, arm: f32, y: [f32; 2]| {
        let (back, front) = (-WALL - out - grow, out + grow);
        pen.block_without(BELOW, vec3(back, y[0], back), vec3(arm + grow, y[1], front));
        pen.block_without(BELOW | BEHIND, vec3(back, y[0], front), vec3(front, y[1], arm + grow));
    };
    pier(0.0, 0.30, [-0.1, EAVE - 0.1]);
    pier(0.06, 0.30, [-0.1, 0.45]);
    pier(0.04, 0.30, [SPRING - 0.18, SPRING + 0.005]);
}

/// Groin vaults over the lower gallery, transverse arches between them, and the vault of one corner.
fn vaults(b: &mut Builder, palette: &Palette, side: &Side) {
    let middle = -WALL - 0.5 * DEPTH;
    for i in 0..side.bays {
        groin(&mut b.on(palette.plaster), vec2((i as f32 + 0.5) * BAY, middle));
    }
    groin(&mut b.on(palette.plaster), vec2(middle, middle));
    // There is a strip as wide as the wall between a corner's vault and the first bay.
    for x in [[-WALL, 0.0], [side.length(), side.length() + WALL]] {
        rib(&mut b.on(palette.ashlar), x, 0.0);
    }
    for i in 1..side.bays {
        let x = i as f32 * BAY;
        rib(&mut b.on(palette.ashlar), [x - 0.16, x + 0.16], 0.10);
    }
    for i in 0..=side.bays {
        pilaster(b, palette, i as f32 * BAY, if i == 0 || i == side.bays { 0.3 } else { 0.2 });
    }
}

/// One square vault: four webs of a cylinder that meet on the diagonals. `centre` in (x, z).
fn groin(pen: &mut Pen<'_>, centre: Vec2) {
    let [spring, rise] = VAULT;
    for turn in 0..4 {
        let (ax, az) = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][turn];
        pen.sheet(16, 3, |s, t| {
            let angle = (2.0 * s - 1.0) * FRAC_PI_2;
            let x = angle.sin();
            // Slightly beyond the edge into the walls, so that no light leaks between them.
            let z = x.abs() + (1.004 - x.abs()) * t;
            let p = 0.5 * BAY * vec2(x * ax - z * az, x * az + z * ax);
            let y = spring + rise * angle.cos();
            (vec3(centre.x + p.x, y, centre.y + p.y), vec2(0.5 * BAY * angle, 0.5 * BAY * z))
        });
    }
}

/// A transverse arch under the vault between `x[0]` and `x[1]`, hanging `drop` below it.
fn rib(pen: &mut Pen<'_>, x: [f32; 2], drop: f32) {
    let [spring, rise] = VAULT;
    let (half, centre) = (0.5 * DEPTH, -WALL - 0.5 * DEPTH);
    let profile = Profile::new(&[[0.02, x[0]], [-drop, x[0]], [-drop, x[1]], [0.02, x[1]]]);
    let stations = (0..=24).map(|k| {
        let angle = PI * k as f32 / 24.0;
        let (sin, cos) = angle.sin_cos();
        let radial = Vec3A::new(0.0, sin * half, cos * rise).normalize();
        let translation = Vec3A::new(0.0, spring + rise * sin, centre + half * cos);
        let matrix3 = Mat3A::from_cols(radial, Vec3A::X, radial.cross(Vec3A::X));
        (Affine3A { matrix3, translation }, angle * half)
    });
    pen.sweep(&profile, stations);
}

/// A flat pier on the outer wall that receives the vault.
fn pilaster(b: &mut Builder, palette: &Palette, x: f32, half: f32) {
    let mut pen = b.on(palette.ashlar);
    pen.block_without(BEHIND | BELOW, vec3(x - half, 0.0, OUTER - 0.1), vec3(x + half, VAULT[0] + 0.1, OUTER + 0.12));
    let mut pen = b.on(palette.marble);
    pen.block_without(
        BEHIND | BELOW,
        vec3(x - half - 0.05, 0.0, OUTER - 0.1),
        vec3(x + half + 0.05, STEP + 0.3, OUTER + 0.16),
    );
    for (grow, y) in [(0.03, [VAULT[0] - 0.26, VAULT[0] - 0.20]), (0.05, [VAULT[0] - 0.16, VAULT[0] - 0.06])] {
        pen.block_without(
            BEHIND,
            vec3(x - half - grow, y[0], OUTER - 0.1),
            vec3(x + half + grow, y[1], OUTER + 0.12 + grow),
        );
    }
}

/// Outer wall, gallery floor and upper ceiling.
fn shell(b: &mut Builder, palette: &Palette, side: &Side) {
    let ends = if side.long { 0 } else { ENDS };
    ring(&mut b.on(palette.brick), side, ends, [-0.3, EAVE + 1.6], [OUTER - 0.35, OUTER]);
    // Gallery floors are one step above the court and carry the columns.
    let buried = ENDS | BEHIND | BELOW;
    ring(&mut b.on(palette.gallery_tiles), side, buried, [-0.25, STEP], [OUTER - 0.1, 0.34]);
    // Wainscot of dressed stone with a moulded rail.
    ring(&mut b.on(palette.ashlar), side, buried, [0.0, 1.25], [OUTER - 0.1, OUTER + 0.06]);
    ring(&mut b.on(palette.marble), side, ENDS | BEHIND, [1.25, 1.33], [OUTER - 0.1, OUTER + 0.09]);
    // Timber ceiling with joists above the upper gallery.
    let mut wood = b.on(palette.wood);
    ring(&mut wood, side, ENDS | BEHIND, [EAVE - 0.1, EAVE - 0.02], [OUTER - 0.1, -0.1]);
    for i in 0..=2 * side.bays {
        let x = i as f32 * 0.5 * BAY;
        wood.block_without(BEHIND, vec3(x - 0.08, EAVE - 0.32, OUTER - 0.1), vec3(x + 0.08, EAVE - 0.09, -0.3));
    }
}

/// Both ends of a ring, which are inside the outer wall or the ring's next side.
const ENDS: u8 = LEFT | RIGHT;

/// One side of a ring around the court between two heights and two distances (`z`: back and front). Long sides extend
/// around the corners; short sides fit between them.
fn ring(pen: &mut Pen<'_>, side: &Side, hidden: u8, y: [f32; 2], z: [f32; 2]) {
    let reach = if side.long { -z[0] } else { -z[1] };
    pen.block_without(hidden, vec3(-reach, y[0], z[0]), vec3(side.length() + reach, y[1], z[1]));
}

/// The tiled roof that slopes towards the court, with the rafters of its eave.
fn roof(b: &mut Builder, palette: &Palette, side: &Side) {
    let (ridge, length) = (OUTER - 0.2, side.length());
    let mut wood = b.on(palette.wood);
    wood.block(vec3(OVERHANG - 0.04, EAVE + 0.02, -0.6), vec3(length - OVERHANG + 0.04, EAVE + 0.06, OVERHANG - 0.04));
    let rafters = side.bays * 6;
    for i in 1..rafters {
        let x = length * i as f32 / rafters as f32;
        if x > OVERHANG && x < length - OVERHANG {
            wood.block(vec3(x - 0.045, EAVE - 0.10, -0.09), vec3(x + 0.045, EAVE + 0.03, OVERHANG - 0.10));
        }
    }
    // Rows of barrel tiles: half-round ridges of one wave each. Neighbouring slopes meet in a valley
    // on the diagonal, where x equals z in either frame.
    let waves = side.bays * 10 + 28;
    let (x0, x1) = (ridge, length - ridge);
    b.on(palette.roof_tiles).sheet(waves * 4, 5, |s, t| {
        let x = x0 + (x1 - x0) * s;
        let z = OVERHANG.min(x).min(length - x);
        let z = z + (ridge - z) * t;
        let wave = (s * waves as f32 * PI).sin().abs();
        let y = EAVE + 0.09 + 0.42 * (OVERHANG - z) + 0.09 * wave;
        (vec3(x, y, z), vec2(0.25 * s * waves as f32, -0.8 * z))
    });
}
