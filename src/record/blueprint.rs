//! The layout that a recording brings along for the viewer.
//!
//! Written as rows of a blueprint store by its published archetypes, because the sdk's own layout
//! builder draws random ids (two recordings of one run would differ) and cannot say which entity a
//! 3-D view follows.

use super::images::WaysidePaths;
use super::observer_error::{Result, failed};
use super::recording_file::SIM_TIME;
use super::stream::RowStream;
use super::{Contents, images, map, path_of, plots, scene, texts};
use crate::bus::TrainId;
use re_sdk_types::blueprint::archetypes::{
    Background, ContainerBlueprint, EyeControls3D, LineGrid3D, PanelBlueprint, PlotLegend,
    TextLogColumns, TimeAxis, TimePanelBlueprint, ViewBlueprint, ViewContents, ViewportBlueprint,
};
use re_sdk_types::blueprint::components::{
    BackgroundKind, ContainerKind, Eye3DKind, PanelState, PlayState, RootContainer, TimeRange,
};
use re_sdk_types::blueprint::datatypes::{TextLogColumn, TextLogColumnKind};
use re_sdk_types::components::Color;
use re_sdk_types::datatypes;
use rerun::{
    AsComponents, RecordingStream, RecordingStreamBuilder, RecordingStreamResult, StoreId,
    StoreKind,
};
use std::ops::Range;

/// One pane, or several.
enum Node {
    Pane(Pane),
    Split(Split),
}

/// Several nodes beside, above or behind each other, with their shares of the room.
struct Split {
    kind: ContainerKind,
    name: Option<String>,
    parts: Vec<(f32, Node)>,
}

/// A view of the viewer.
struct Pane {
    class: &'static str,
    name: String,
    origin: String,
    contents: Vec<String>,
    properties: Vec<(&'static str, Box<dyn AsComponents>)>,
}

impl Pane {
    fn new(class: &'static str, name: impl Into<String>, origin: impl Into<String>) -> Self {
        Self {
            class,
            name: name.into(),
            origin: origin.into(),
            contents: vec!["+ $origin/**".into()],
            properties: Vec::new(),
        }
    }

    fn with(mut self, name: &'static str, property: impl AsComponents + 'static) -> Self {
        self.properties.push((name, Box::new(property)));
        self
    }
}

/// Sends the layout for what this run has.
pub(super) fn send(
    stream: &RowStream,
    contents: &[Contents],
    eye: ([f32; 3], [f32; 3]),
    has_map: bool,
) -> Result {
    let id = StoreId::new(StoreKind::Blueprint, stream.application().clone(), "layout");
    let (rerun, messages) = RecordingStreamBuilder::from_store_id(&id)
        .enabled(true)
        .send_properties(false)
        .memory()
        .map_err(failed("making the layout"))?;
    rerun.set_log_time_enabled(false);
    rerun.set_log_tick_enabled(false);
    rerun.set_time_sequence("blueprint", 0);
    write(&rerun, &layout(contents, eye, has_map)).map_err(failed("writing the layout"))?;
    stream.blueprint(messages.take(), id);
    Ok(())
}

/// The panes for a window of 1600 x 1000: where the first train is on the left, what the cameras see
/// and the stack says on the right. What there is of each train is in tabs.
fn layout(contents: &[Contents], eye: ([f32; 3], [f32; 3]), has_map: bool) -> Node {
    let mut right = Vec::new();
    let rigs = contents.iter().filter(|train| train.rig);
    let rigs: Vec<_> = rigs.map(|train| named(train.id, eyes(train.id))).collect();
    if !rigs.is_empty() {
        right.push((3.0, tabbed(rigs)));
    }
    let first = &contents[0];
    if !first.devices.is_empty() {
        let devices = first.devices.iter();
        let devices = tabbed(devices.map(|name| wayside(name, &WaysidePaths::new(name))));
        right.push((3.6, devices));
    }
    let mut words = vec![(1.9, Node::Pane(events()))];
    let displays = contents.iter().filter(|train| train.protection);
    let displays: Vec<_> = displays.map(|train| display(train.id)).collect();
    if !displays.is_empty() {
        words.insert(0, (1.0, tabbed(displays)));
    }
    right.push((2.6, row(words)));

    let mut places = vec![Node::Pane(world(first, eye))];
    let map = has_map.then(|| Node::Pane(Pane::new("Map", "Map", map::ROOT)));
    // On the map is what track occupancy says.
    match map {
        Some(map) if contents.iter().any(|train| train.occupancy) => right.insert(0, (4.4, map)),
        map => places.extend(map),
    }
    let mut left = vec![(4.4, tabbed(places))];
    if let [only] = contents {
        left.extend(plots(only));
    } else {
        let trains = contents
            .iter()
            .map(|train| named(train.id, column(plots(train))));
        left.push((4.4, tabbed(trains)));
    }
    row([(1.0, column(left)), (1.0, column(right))])
}

/// Both eyes of a train's rig.
fn eyes(id: TrainId) -> Node {
    row([
        (1.0, image("Left camera", path_of(id, images::LEFT))),
        (1.0, image("Right camera", path_of(id, images::RIGHT))),
    ])
}

fn display(id: TrainId) -> Node {
    let name = match id.index() {
        0 => "Driver's display".to_owned(),
        _ => format!("Driver's display, {id}"),
    };
    Node::Pane(Pane::new("TextDocument", name, path_of(id, texts::DISPLAY)))
}

/// The plots of a train, two panes a row.
fn plots(contents: &Contents) -> Vec<(f32, Node)> {
    let plot = |group: &plots::PlotGroup| plot(contents.id, group);
    let panes = plots::panes(contents);
    let rows = panes.chunks(2).map(|pair| {
        let panes = pair.iter().map(|tabs| (1.0, tabbed(tabs.iter().map(plot))));
        (2.2, row(panes))
    });
    rows.collect()
}

fn split(kind: ContainerKind, parts: impl IntoIterator<Item = (f32, Node)>) -> Node {
    Node::Split(Split {
        kind,
        name: None,
        parts: parts.into_iter().collect(),
    })
}

fn row(parts: impl IntoIterator<Item = (f32, Node)>) -> Node {
    split(ContainerKind::Horizontal, parts)
}

fn column(parts: impl IntoIterator<Item = (f32, Node)>) -> Node {
    split(ContainerKind::Vertical, parts)
}

/// With a train's name on its tab.
fn named(id: TrainId, node: Node) -> Node {
    match node {
        Node::Split(split) => Node::Split(Split {
            name: Some(id.to_string()),
            ..split
        }),
        pane => pane,
    }
}

fn image(name: impl Into<String>, origin: impl Into<String>) -> Node {
    Node::Pane(Pane::new("2D", name, origin))
}

fn wayside(name: &str, paths: &WaysidePaths) -> Node {
    let found = [
        (1.0, image("Difference", paths.difference.as_str())),
        (1.0, image("Binary", paths.binary.as_str())),
    ];
    row([
        (2.0, image(format!("{name}: camera"), paths.camera.as_str())),
        (1.0, column(found)),
    ])
}

/// One node as it is, several as tabs.
fn tabbed(nodes: impl IntoIterator<Item = Node>) -> Node {
    let nodes: Vec<_> = nodes.into_iter().map(|node| (1.0, node)).collect();
    match <[_; 1]>::try_from(nodes) {
        Ok([(_, only)]) => only,
        Err(nodes) => split(ContainerKind::Tabs, nodes),
    }
}

fn plot(id: TrainId, group: &plots::PlotGroup) -> Node {
    let legend = PlotLegend::new().with_corner(group.legend);
    // All of the run. Left alone, a plot scrolls with the time, and one of more than a minute opens
    // half empty.
    let whole = TimeAxis::new().with_view_range(TimeRange(datatypes::TimeRange::EVERYTHING));
    let pane = Pane::new("TimeSeries", group.title, path_of(id, group.origin));
    Node::Pane(pane.with("PlotLegend", legend).with("TimeAxis", whole))
}

/// The log without the column that says that each line is of the log.
fn events() -> Pane {
    let columns = [TextLogColumnKind::LogLevel, TextLogColumnKind::Body];
    let columns = columns.map(|kind| TextLogColumn {
        kind,
        visible: true.into(),
    });
    Pane::new("TextLog", "Events", texts::EVENTS).with(
        "TextLogColumns",
        TextLogColumns::new().with_text_log_columns(columns),
    )
}

/// The 3-D view. The eye rides along with the head.
fn world(contents: &Contents, (position, target): ([f32; 3], [f32; 3])) -> Pane {
    let mut eye = EyeControls3D::new()
        .with_kind(Eye3DKind::Orbital)
        .with_position(position)
        .with_look_target(target)
        .with_eye_up([0.0, 0.0, 1.0]);
    if contents.head() {
        eye = eye.with_tracking_entity(scene::HEAD);
    }
    Pane::new("3D", "Track", "world")
        .with("EyeControls3D", eye)
        .with("LineGrid3D", LineGrid3D::new().with_visible(false))
        .with(
            "Background",
            Background::new(BackgroundKind::SolidColor).with_color(Color::from_rgb(14, 17, 22)),
        )
}

fn write(rerun: &RecordingStream, root: &Node) -> RecordingStreamResult<()> {
    let mut next = 0;
    let root = write_node(rerun, root, &mut next)?;
    rerun.log(
        "viewport",
        &ViewportBlueprint::new()
            .with_root_container(RootContainer(datatypes::Uuid { bytes: root }))
            .with_auto_layout(false)
            .with_auto_views(false),
    )?;
    for panel in ["blueprint_panel", "selection_panel"] {
        rerun.log(
            panel,
            &PanelBlueprint::new().with_state(PanelState::Collapsed),
        )?;
    }
    // At the latest time: a run is followed as it goes, and a file opens at its end, with all that
    // was plotted and said.
    rerun.log(
        "time_panel",
        &TimePanelBlueprint::new()
            .with_state(PanelState::Collapsed)
            .with_timeline(SIM_TIME)
            .with_play_state(PlayState::Following),
    )
}

/// Writes a node after its children; returns its id.
fn write_node(
    rerun: &RecordingStream,
    node: &Node,
    next: &mut u64,
) -> RecordingStreamResult<[u8; 16]> {
    let id = |next: &mut u64| {
        *next += 1;
        (u128::from(*next)).to_be_bytes()
    };
    match node {
        Node::Pane(pane) => {
            let id = id(next);
            write_pane(rerun, pane, &node_path(node, id))?;
            Ok(id)
        }
        Node::Split(Split { kind, name, parts }) => {
            let mut paths = Vec::with_capacity(parts.len());
            for (_, part) in parts {
                let id = write_node(rerun, part, next)?;
                paths.push(node_path(part, id));
            }
            let id = id(next);
            let shares = parts.iter().map(|(share, _)| *share);
            let container = ContainerBlueprint::new(*kind).with_contents(paths);
            let container = match name {
                Some(name) => container.with_display_name(name.as_str()),
                None => container,
            };
            let container = match kind {
                ContainerKind::Vertical => container.with_row_shares(shares),
                _ => container.with_col_shares(shares),
            };
            rerun.log(node_path(node, id), &container)?;
            Ok(id)
        }
    }
}

fn write_pane(rerun: &RecordingStream, pane: &Pane, path: &str) -> RecordingStreamResult<()> {
    let contents = ViewContents::new(pane.contents.iter().map(String::as_str));
    rerun.log(format!("{path}/ViewContents"), &contents)?;
    let view = ViewBlueprint::new(pane.class)
        .with_display_name(pane.name.as_str())
        .with_space_origin(pane.origin.as_str());
    rerun.log(path, &view)?;
    for (name, property) in &pane.properties {
        rerun.log(format!("{path}/{name}"), property.as_ref())?;
    }
    Ok(())
}

/// Where the viewer looks for a node: its id in the usual notation of a UUID.
fn node_path(node: &Node, id: [u8; 16]) -> String {
    let kind = match node {
        Node::Pane(_) => "view",
        Node::Split(..) => "container",
    };
    let hex = |part: Range<usize>| -> String {
        let bytes = id[part].iter();
        bytes.map(|byte| format!("{byte:02x}")).collect()
    };
    let parts = [0..4, 4..6, 6..8, 8..10, 10..16].map(hex);
    format!("{kind}/{}", parts.join("-"))
}
