//! Which detection belongs to which target, so that all together cost least (global nearest neighbour).
//!
//! The Hungarian method with shortest augmenting paths, on each group of targets and detections that have to do with each
//! other. Crates that solve this take integer costs and bring a graph library; the method itself is short.
//!
//! Source: R. Jonker and A. Volgenant, A Shortest Augmenting Path Algorithm for Dense and Sparse Linear Assignment
//! Problems, Computing 38 (1987).

/// A pair that may be: target, detection, cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AssignedPair {
    /// Number of the target.
    pub target: usize,
    /// Number of the detection.
    pub detection: usize,
    /// Less is likelier.
    pub cost: f64,
}

/// The detection of each target, if any. A target without one costs `missed`.
pub fn assign(targets: usize, pairs: &[AssignedPair], missed: &[f64]) -> Vec<Option<usize>> {
    let mut assigned = vec![None; targets];
    for group in groups(targets, pairs) {
        let own = |pair: &&AssignedPair| group.contains(&pair.target);
        let pairs: Vec<AssignedPair> = pairs.iter().filter(own).copied().collect();
        let mut detections: Vec<usize> = pairs.iter().map(|pair| pair.detection).collect();
        detections.sort_unstable();
        detections.dedup();
        let costs = table(&group, &detections, &pairs, missed);
        for (row, column) in least_cost(&costs).into_iter().enumerate() {
            assigned[group[row]] = detections.get(column).copied();
        }
    }
    assigned
}

/// Targets that share detections, in order; none that has no pair.
fn groups(targets: usize, pairs: &[AssignedPair]) -> Vec<Vec<usize>> {
    let mut group_of: Vec<usize> = (0..targets).collect();
    let mut by_detection: Vec<AssignedPair> = pairs.to_vec();
    by_detection.sort_by_key(|pair| (pair.detection, pair.target));
    for two in by_detection.windows(2) {
        if two[0].detection == two[1].detection {
            let (a, b) = (group_of[two[0].target], group_of[two[1].target]);
            let (low, high) = (a.min(b), a.max(b));
            group_of
                .iter_mut()
                .filter(|g| **g == high)
                .for_each(|g| *g = low);
        }
    }
    let has_pair = |target: &usize| pairs.iter().any(|pair| pair.target == *target);
    let of = |group: usize| {
        (0..targets)
            .filter(|t| group_of[*t] == group)
            .filter(has_pair)
            .collect()
    };
    let groups = (0..targets)
        .map(of)
        .filter(|group: &Vec<usize>| !group.is_empty());
    groups.collect()
}

/// By target: the cost of each detection, and of none, of which each has one of its own.
fn table(
    group: &[usize],
    detections: &[usize],
    pairs: &[AssignedPair],
    missed: &[f64],
) -> Vec<Vec<f64>> {
    let row = |(k, target): (usize, &usize)| {
        let mut row = vec![f64::INFINITY; detections.len() + group.len()];
        row[detections.len() + k] = missed[*target];
        for pair in pairs.iter().filter(|pair| pair.target == *target) {
            if let Ok(column) = detections.binary_search(&pair.detection) {
                row[column] = pair.cost;
            }
        }
        row
    };
    group.iter().enumerate().map(row).collect()
}

/// The column of each row. Each row has a column that it alone can have, so that there always is a way.
fn least_cost(costs: &[Vec<f64>]) -> Vec<usize> {
    let columns = costs.first().map_or(0, Vec::len);
    let mut row_of: Vec<Option<usize>> = vec![None; columns];
    let (mut row_price, mut column_price) = (vec![0.0; costs.len()], vec![0.0; columns]);
    for first in 0..costs.len() {
        augment(
            costs,
            first,
            &mut row_of,
            (&mut row_price, &mut column_price),
        );
    }
    let mut column_of = vec![columns; costs.len()];
    for (column, row) in row_of.iter().enumerate() {
        if let Some(row) = row {
            column_of[*row] = column;
        }
    }
    column_of
}

/// Gives one more row a column, by the shortest way over columns whose rows take another.
fn augment(
    costs: &[Vec<f64>],
    first: usize,
    row_of: &mut [Option<usize>],
    (row_price, column_price): (&mut [f64], &mut [f64]),
) {
    let columns = row_of.len();
    let mut way = vec![f64::INFINITY; columns];
    let mut from: Vec<Option<usize>> = vec![None; columns];
    let mut done = vec![false; columns];
    let (mut row, mut last, mut length) = (first, None, 0.0);
    let end = loop {
        for column in (0..columns).filter(|column| !done[*column]) {
            let onwards = length + costs[row][column] - row_price[row] - column_price[column];
            if onwards < way[column] {
                (way[column], from[column]) = (onwards, last);
            }
        }
        let open = (0..columns).filter(|column| !done[*column] && way[*column].is_finite());
        let Some(next) = open.min_by(|a, b| way[*a].total_cmp(&way[*b])) else {
            return;
        };
        (done[next], length) = (true, way[next]);
        match row_of[next] {
            Some(other) => (row, last) = (other, Some(next)),
            None => break next,
        }
    };
    row_price[first] += length;
    for column in (0..columns).filter(|column| done[*column] && *column != end) {
        if let Some(row) = row_of[column] {
            row_price[row] += length - way[column];
        }
        column_price[column] -= length - way[column];
    }
    let mut column = end;
    while let Some(before) = from[column] {
        row_of[column] = row_of[before];
        column = before;
    }
    row_of[column] = Some(first);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stack::radar::testing::Draw;

    fn cost(assigned: &[Option<usize>], pairs: &[AssignedPair], missed: &[f64]) -> f64 {
        let of = |(target, detection): (usize, &Option<usize>)| {
            let pair = pairs
                .iter()
                .find(|p| p.target == target && Some(p.detection) == *detection);
            pair.map_or(missed[target], |pair| pair.cost)
        };
        assigned.iter().enumerate().map(of).sum()
    }

    /// The least cost of all ways, one by one.
    fn by_trial(target: usize, used: u32, pairs: &[AssignedPair], missed: &[f64]) -> f64 {
        if target == missed.len() {
            return 0.0;
        }
        let own = pairs
            .iter()
            .filter(|p| p.target == target && used & 1 << p.detection == 0);
        let ways =
            own.map(|p| p.cost + by_trial(target + 1, used | 1 << p.detection, pairs, missed));
        ways.fold(
            missed[target] + by_trial(target + 1, used, pairs, missed),
            f64::min,
        )
    }

    /// Against trying all ways, on drawn tables with few and many pairs; no detection is given twice.
    #[test]
    fn the_cost_is_the_least_of_all_ways() {
        let mut draw = Draw::new(4);
        for k in 0..500 {
            let targets = k % 6;
            let share = draw.uniform();
            let mut pairs = Vec::new();
            for target in 0..targets {
                for detection in 0..5 {
                    let cost = 20.0 * draw.uniform() - 5.0;
                    if draw.uniform() < share {
                        pairs.push(AssignedPair {
                            target,
                            detection,
                            cost,
                        });
                    }
                }
            }
            let missed: Vec<f64> = (0..targets).map(|_| 15.0 * draw.uniform()).collect();
            let assigned = assign(targets, &pairs, &missed);
            let expected = by_trial(0, 0, &pairs, &missed);
            assert!(
                (cost(&assigned, &pairs, &missed) - expected).abs() < 1e-9,
                "{pairs:?}"
            );
            let mut given: Vec<usize> = assigned.iter().flatten().copied().collect();
            let count = given.len();
            given.sort_unstable();
            given.dedup();
            assert_eq!(given.len(), count);
        }
    }
}
