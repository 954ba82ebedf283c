//! A hierarchy of boxes, split at the median, to find what is near a point.

use crate::math::Vec3;

/// Items in a leaf.
const LEAF: usize = 4;

/// A box of items.
#[derive(Clone, Debug)]
struct Node {
    low: Vec3,
    high: Vec3,
    /// Range in [`Boxes::order`].
    items: [u32; 2],
    /// The second child; the first one follows its parent. Zero for a leaf.
    second: u32,
}

/// The hierarchy.
#[derive(Clone, Debug)]
pub(super) struct Boxes {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

impl Boxes {
    /// Over items given by their boxes, lower and upper corner \[mm\].
    pub fn new(items: &[(Vec3, Vec3)]) -> Boxes {
        let mut boxes = Boxes {
            nodes: Vec::new(),
            order: (0..items.len() as u32).collect(),
        };
        let mut order = std::mem::take(&mut boxes.order);
        if !order.is_empty() {
            boxes.split(items, &mut order, 0);
        }
        boxes.order = order;
        boxes
    }

    fn split(&mut self, items: &[(Vec3, Vec3)], order: &mut [u32], start: usize) {
        let place = self.nodes.len();
        let over = |of: &[u32], pick: fn(&(Vec3, Vec3)) -> (Vec3, Vec3)| {
            let empty = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
            of.iter()
                .map(|&i| pick(&items[i as usize]))
                .fold(empty, |(low, high), (l, h)| (low.inf(&l), high.sup(&h)))
        };
        let (low, high) = over(order, |b| *b);
        self.nodes.push(Node {
            low,
            high,
            items: [start as u32, (start + order.len()) as u32],
            second: 0,
        });
        if order.len() <= LEAF {
            return;
        }
        let (from, to) = over(order, |b| ((b.0 + b.1) / 2.0, (b.0 + b.1) / 2.0));
        let axis = (to - from).imax();
        let middle = order.len() / 2;
        let centre = |i: u32| items[i as usize].0[axis] + items[i as usize].1[axis];
        // Ties by number, so that the order does not depend on the selection algorithm.
        order.select_nth_unstable_by(middle, |&s, &t| centre(s).total_cmp(&centre(t)).then(s.cmp(&t)));
        let (first, second) = order.split_at_mut(middle);
        self.split(items, first, start);
        self.nodes[place].second = self.nodes.len() as u32;
        self.split(items, second, start + middle);
    }

    /// The item nearest to `x` by `distance` \[mm\], which is never less than that to the item's box; its number and what
    /// came with the distance. Of several equally near ones, the first visited.
    pub fn nearest<T>(&self, x: &Vec3, mut distance: impl FnMut(u32) -> (f64, T)) -> Option<(u32, f64, T)> {
        let mut best: Option<(u32, f64, T)> = None;
        let mut pending = vec![(0.0, 0_u32)];
        while let Some((bound, place)) = pending.pop() {
            let Some(node) = self.nodes.get(place as usize) else {
                break;
            };
            if best.as_ref().is_some_and(|(_, least, _)| bound >= *least) {
                continue;
            }
            if node.second == 0 {
                for &item in &self.order[node.items[0] as usize..node.items[1] as usize] {
                    let (found, with) = distance(item);
                    if best.as_ref().is_none_or(|(_, least, _)| found < *least) {
                        best = Some((item, found, with));
                    }
                }
                continue;
            }
            let mut children = [place + 1, node.second].map(|child| (self.outside(child, x), child));
            // The nearer one is looked at first.
            if children[0].0 < children[1].0 {
                children.swap(0, 1);
            }
            pending.extend(children);
        }
        best
    }

    /// Calls `visit` with every item whose box holds `x`.
    pub fn holding(&self, x: &Vec3, mut visit: impl FnMut(u32)) {
        let mut pending = vec![0_u32];
        while let Some(place) = pending.pop() {
            let Some(node) = self.nodes.get(place as usize) else {
                break;
            };
            if self.outside(place, x) > 0.0 {
                continue;
            }
            if node.second == 0 {
                self.order[node.items[0] as usize..node.items[1] as usize]
                    .iter()
                    .for_each(|&item| visit(item));
            } else {
                pending.extend([node.second, place + 1]);
            }
        }
    }

    /// Distance from a node's box \[mm\], zero inside.
    fn outside(&self, place: u32, x: &Vec3) -> f64 {
        let node = &self.nodes[place as usize];
        (node.low - x).sup(&(x - node.high)).sup(&Vec3::zeros()).norm()
    }
}
