//! The scenes.

use crate::render::Scene;
use crate::shapes::Shape;
use crate::vector::{Vector, add, cross, scale, unit};

/// The names that [`scene`] knows.
pub const SCENES: [&str; 11] = [
    "plane",
    "sphere",
    "cylinder",
    "box",
    "crease-90",
    "crease-135",
    "ridge-90",
    "ridge-135",
    "steps",
    "tabletop",
    "room",
];

/// A scene by its name, one of [`SCENES`], with the sizes and distances that suit a Kinect.
pub fn scene(name: &str) -> Option<Scene> {
    Some(match name {
        "plane" => plane(30.0, 20.0, 1.5),
        "sphere" => sphere(),
        "cylinder" => cylinder(),
        "box" => box_on_floor(),
        "crease-90" => crease(90.0, false),
        "crease-135" => crease(135.0, false),
        "ridge-90" => crease(90.0, true),
        "ridge-135" => crease(135.0, true),
        "steps" => steps(),
        "tabletop" => tabletop(),
        "room" => room(),
        _ => return None,
    })
}

/// One plane through (0, 0, `distance`), `tilt` degrees from frontal, towards `azimuth` degrees from the x axis.
pub fn plane(tilt: f64, azimuth: f64, distance: f64) -> Scene {
    let (tilt, azimuth) = (tilt.to_radians(), azimuth.to_radians());
    let normal = [tilt.sin() * azimuth.cos(), tilt.sin() * azimuth.sin(), -tilt.cos()];
    Scene { shapes: vec![Shape::Plane { point: [0.0, 0.0, distance], normal }] }
}

/// A sphere, 0.75 m away where it is nearest, that fills the middle of the image, and nothing else.
fn sphere() -> Scene {
    Scene { shapes: vec![Shape::Sphere { center: [0.0, 0.0, 1.2], radius: 0.45 }] }
}

/// A leaning cylinder that fills the height of the image, and nothing else.
fn cylinder() -> Scene {
    let axis = unit([0.25, 1.0, 0.1]);
    let base = add([0.0, 0.0, 1.6], scale(axis, -3.0));
    Scene { shapes: vec![Shape::Cylinder { base, axis: scale(axis, 6.0), radius: 0.35 }] }
}

/// Two planes that meet at `angle` degrees in a line through (0, 0, 1.5), a ridge towards the camera or a valley. The
/// line is turned 20 degrees from vertical, and one plane faces the camera more than the other.
fn crease(angle: f64, ridge: bool) -> Scene {
    let (sin, cos) = 20f64.to_radians().sin_cos();
    let along: Vector = [-sin, cos, 0.0];
    let across: Vector = [cos, sin, 0.0];
    let bend = if ridge { 1.0 } else { -1.0 };
    let half = (angle / 2.0).to_radians();
    let side = |turn: f64| {
        // In the plane across the line, from the line towards one side of it.
        let direction = turn + 10f64.to_radians();
        let out = add(scale(across, direction.sin()), [0.0, 0.0, bend * direction.cos()]);
        let origin = add([0.0, 0.0, 1.5], scale(along, -20.0));
        Shape::Patch { origin, u: scale(along, 40.0), v: scale(out, 20.0) }
    };
    Scene { shapes: vec![side(-half), side(half)] }
}

/// A box, turned by 35 degrees, on a floor that is seen from above, before a wall.
fn box_on_floor() -> Scene {
    let floor = Floor::new(30.0, [0.0, 0.2, 1.6]);
    let mut shapes = vec![floor.shape(), wall(3.0)];
    shapes.push(floor.cuboid([0.0, 0.0], [0.25, 0.2, 0.3], 35.0));
    Scene { shapes }
}

/// Frontal strips side by side, each one farther away than the one to its left: by 2, 4, 8, 16, 32 and 64 cm.
fn steps() -> Scene {
    const STRIPS: i32 = 7;
    const WIDTH: f64 = 0.18; // at z = 1
    let mut z = 1.0;
    let mut shapes = Vec::new();
    for i in 0..STRIPS {
        let left = WIDTH * (f64::from(i) - f64::from(STRIPS) / 2.0);
        let width = if i + 1 < STRIPS { WIDTH } else { 2.0 };
        let origin = [left * z, -2.0 * z, z];
        shapes.push(Shape::Patch { origin, u: [width * z, 0.0, 0.0], v: [0.0, 4.0 * z, 0.0] });
        z += 0.01 * f64::from(2 << i);
    }
    Scene { shapes }
}

/// A table with a box, a cylinder and a sphere on it, before a wall.
fn tabletop() -> Scene {
    let table = Floor::new(35.0, [0.0, 0.1, 1.3]);
    Scene {
        shapes: vec![
            wall(2.6),
            table.slab([0.0, 0.1], [1.3, 0.9], 0.04),
            table.cuboid([-0.28, 0.05], [0.22, 0.16, 0.2], 30.0),
            table.cylinder([0.05, 0.2], 0.06, 0.25),
            table.sphere([0.3, -0.02], 0.11),
        ],
    }
}

/// The inside of a room, with a box on the floor.
fn room() -> Scene {
    let plane = |point, normal| Shape::Plane { point, normal };
    let turned = |x: f64, y: f64, z: f64| {
        // The camera looks 15 degrees down and 25 degrees to the side.
        let (sa, ca) = 25f64.to_radians().sin_cos();
        let (sb, cb) = 15f64.to_radians().sin_cos();
        let (x, z) = (ca * x + sa * z, -sa * x + ca * z);
        [x, cb * y - sb * z, sb * y + cb * z]
    };
    let half = [turned(0.3, 0.0, 0.0), turned(0.0, 0.35, 0.0), turned(0.0, 0.0, 0.25)];
    Scene {
        shapes: vec![
            plane(turned(0.0, 1.3, 0.0), turned(0.0, 1.0, 0.0)),
            plane(turned(0.0, -1.3, 0.0), turned(0.0, 1.0, 0.0)),
            plane(turned(-1.6, 0.0, 0.0), turned(1.0, 0.0, 0.0)),
            plane(turned(1.9, 0.0, 0.0), turned(1.0, 0.0, 0.0)),
            plane(turned(0.0, 0.0, 3.2), turned(0.0, 0.0, 1.0)),
            Shape::Cuboid { center: turned(-0.5, 0.95, 2.4), half },
        ],
    }
}

fn wall(z: f64) -> Shape {
    Shape::Plane { point: [0.0, 0.0, z], normal: [0.15, 0.05, -1.0] }
}

/// A floor or table seen from above, and where things stand on it.
struct Floor {
    origin: Vector,
    right: Vector,
    up: Vector,
    away: Vector,
}

impl Floor {
    /// The floor through `origin`, seen from `angle` degrees above it.
    fn new(angle: f64, origin: Vector) -> Self {
        let (sin, cos) = angle.to_radians().sin_cos();
        let (right, up) = ([1.0, 0.0, 0.0], [0.0, -cos, -sin]);
        Floor { origin, right, up, away: cross(up, right) }
    }

    fn at(&self, [right, away]: [f64; 2], up: f64) -> Vector {
        let aside = add(scale(self.right, right), scale(self.away, away));
        add(self.origin, add(aside, scale(self.up, up)))
    }

    fn shape(&self) -> Shape {
        Shape::Plane { point: self.origin, normal: self.up }
    }

    /// A slab whose upper side is the floor.
    fn slab(&self, at: [f64; 2], [width, depth]: [f64; 2], thickness: f64) -> Shape {
        let half = [
            scale(self.right, width / 2.0),
            scale(self.up, thickness / 2.0),
            scale(self.away, depth / 2.0),
        ];
        Shape::Cuboid { center: self.at(at, -thickness / 2.0), half }
    }

    /// A box of this width, depth and height that stands on the floor, turned by `turn` degrees.
    fn cuboid(&self, at: [f64; 2], [width, depth, height]: [f64; 3], turn: f64) -> Shape {
        let (sin, cos) = turn.to_radians().sin_cos();
        let right = add(scale(self.right, cos), scale(self.away, sin));
        let away = add(scale(self.right, -sin), scale(self.away, cos));
        let half =
            [scale(right, width / 2.0), scale(self.up, height / 2.0), scale(away, depth / 2.0)];
        Shape::Cuboid { center: self.at(at, height / 2.0), half }
    }

    fn cylinder(&self, at: [f64; 2], radius: f64, height: f64) -> Shape {
        Shape::Cylinder { base: self.at(at, 0.0), axis: scale(self.up, height), radius }
    }

    fn sphere(&self, at: [f64; 2], radius: f64) -> Shape {
        Shape::Sphere { center: self.at(at, radius), radius }
    }
}
