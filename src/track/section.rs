//! Cross-sections: the outline of a tunnel as seen along the line.

/// What a stretch of the outline is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Material {
    /// Tunnel lining (concrete rings).
    Lining,
    /// Track bed.
    Bed,
    /// Walkway along the wall.
    Walkway,
    /// Rail.
    Rail,
    /// Station platform.
    Platform,
}

/// One corner of the outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutlinePoint {
    /// Left of the centreline.
    pub l_m: f64,
    /// Above top of rail.
    pub h_m: f64,
}

/// A polygonal outline. Points run so that the inside of the tunnel is on the left of each edge
/// when looked at up the line (s away from the viewer, l to the left, h up).
#[derive(Clone, Debug, PartialEq)]
pub struct CrossSection {
    /// Corners in order; an edge joins each to the next, and the last to the first when `closed`.
    pub points: Vec<OutlinePoint>,
    /// Material of the edge that starts at each point.
    pub materials: Vec<Material>,
    /// Closed all around (an open cutting is not).
    pub closed: bool,
}

/// A cross-section over a range of chainage.
#[derive(Clone, Debug, PartialEq)]
pub struct SectionRange {
    /// From this chainage.
    pub from_m: f64,
    /// To this chainage.
    pub to_m: f64,
    /// The outline.
    pub section: CrossSection,
}
