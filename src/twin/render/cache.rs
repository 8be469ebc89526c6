//! The latest few of what is costly to make.

use std::collections::VecDeque;

/// Values by key; the oldest goes when there are too many.
pub struct Cache<K, T> {
    kept: VecDeque<(K, T)>,
    most: usize,
}

impl<K: PartialEq, T> Cache<K, T> {
    /// Of at most so many.
    pub fn new(most: usize) -> Self {
        Self {
            kept: VecDeque::new(),
            most,
        }
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.kept.clear();
    }

    /// The value of a key, made now if it is new.
    pub fn get(&mut self, key: K, make: impl FnOnce(&K) -> T) -> &T {
        let known = self.kept.iter().position(|(k, _)| *k == key);
        let at = known.unwrap_or_else(|| {
            if self.kept.len() >= self.most {
                self.kept.pop_front();
            }
            let made = make(&key);
            self.kept.push_back((key, made));
            self.kept.len() - 1
        });
        &self.kept[at].1
    }
}
