//! What a ray can hit.

use crate::vector::{Vector, add, cross, dot, scale, sub, unit};

/// A surface or a solid.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// An infinite plane through a point.
    Plane {
        /// A point of the plane.
        point: Vector,
        /// Its normal, of any length but 0.
        normal: Vector,
    },
    /// The parallelogram of the points origin + s u + t v, s and t from 0 to 1.
    Patch {
        /// A corner.
        origin: Vector,
        /// The first edge.
        u: Vector,
        /// The second edge.
        v: Vector,
    },
    /// A sphere.
    Sphere {
        /// Its centre.
        center: Vector,
        /// Its radius.
        radius: f64,
    },
    /// A solid cylinder.
    Cylinder {
        /// The middle of its first cap.
        base: Vector,
        /// From the first cap's middle to the second one's.
        axis: Vector,
        /// Its radius.
        radius: f64,
    },
    /// A box.
    Cuboid {
        /// Its centre.
        center: Vector,
        /// From the centre to the middles of three faces; orthogonal to each other.
        half: [Vector; 3],
    },
}

/// Where a ray from the origin meets a shape.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    /// Multiples of the ray's direction.
    pub t: f64,
    /// Unit normal, on either side.
    pub normal: Vector,
    /// Which smooth part of the shape.
    pub part: u16,
}

const NEAREST: f64 = 1e-9;

impl Shape {
    /// How many smooth parts the shape has.
    pub(crate) fn parts(&self) -> u16 {
        match self {
            Shape::Plane { .. } | Shape::Patch { .. } | Shape::Sphere { .. } => 1,
            Shape::Cylinder { .. } => 3,
            Shape::Cuboid { .. } => 6,
        }
    }

    /// The first hit of the ray from the origin.
    pub(crate) fn hit(&self, direction: Vector) -> Option<Hit> {
        match *self {
            Shape::Plane { point, normal } => {
                let t = plane(point, normal, direction)?;
                Some(Hit { t, normal: unit(normal), part: 0 })
            }
            Shape::Patch { origin, u, v } => {
                let normal = cross(u, v);
                let t = plane(origin, normal, direction)?;
                let at = sub(scale(direction, t), origin);
                let area = dot(normal, normal);
                let s = dot(cross(at, v), normal) / area;
                let r = dot(cross(u, at), normal) / area;
                let inside = (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&r);
                inside.then(|| Hit { t, normal: unit(normal), part: 0 })
            }
            Shape::Sphere { center, radius } => {
                let t = quadratic(
                    dot(direction, direction),
                    dot(direction, center),
                    dot(center, center) - radius * radius,
                )?;
                let normal = unit(sub(scale(direction, t), center));
                Some(Hit { t, normal, part: 0 })
            }
            Shape::Cylinder { base, axis, radius } => hit_cylinder(base, axis, radius, direction),
            Shape::Cuboid { center, half } => hit_cuboid(center, half, direction),
        }
    }
}

fn plane(point: Vector, normal: Vector, direction: Vector) -> Option<f64> {
    let t = dot(point, normal) / dot(direction, normal);
    (t.is_finite() && t > NEAREST).then_some(t)
}

/// The smaller positive root of a t^2 - 2 b t + c.
fn quadratic(a: f64, b: f64, c: f64) -> Option<f64> {
    let discriminant = b * b - a * c;
    if discriminant < 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    [(b - root) / a, (b + root) / a].into_iter().find(|t| *t > NEAREST)
}

fn hit_cylinder(base: Vector, axis: Vector, radius: f64, direction: Vector) -> Option<Hit> {
    let height = dot(axis, axis).sqrt();
    let up = scale(axis, 1.0 / height);
    let across = |v: Vector| sub(v, scale(up, dot(v, up)));
    let (d, b) = (across(direction), across(base));
    let side = quadratic(dot(d, d), dot(d, b), dot(b, b) - radius * radius).and_then(|t| {
        let along = dot(sub(scale(direction, t), base), up);
        let normal = unit(sub(scale(d, t), b));
        (0.0..=height).contains(&along).then_some(Hit { t, normal, part: 0 })
    });
    let cap = |middle: Vector, part| {
        let t = plane(middle, up, direction)?;
        let at = sub(scale(direction, t), middle);
        (dot(at, at) <= radius * radius).then_some(Hit { t, normal: up, part })
    };
    [side, cap(base, 1), cap(add(base, axis), 2)]
        .into_iter()
        .flatten()
        .min_by(|a, b| a.t.total_cmp(&b.t))
}

fn hit_cuboid(center: Vector, half: [Vector; 3], direction: Vector) -> Option<Hit> {
    let (mut near, mut far) =
        (Hit { t: f64::NEG_INFINITY, normal: [0.0; 3], part: 0 }, f64::INFINITY);
    for (i, axis) in half.into_iter().enumerate() {
        let size = dot(axis, axis);
        let (middle, slope) = (dot(center, axis), dot(direction, axis));
        let (a, b) = ((middle - size) / slope, (middle + size) / slope);
        let first = a.min(b);
        if first > near.t {
            let part = 2 * i as u16 + u16::from(b < a);
            near = Hit { t: first, normal: unit(axis), part };
        }
        far = far.min(a.max(b));
    }
    (near.t <= far && near.t > NEAREST).then_some(near)
}
