//! The latest few of what is costly to make.

use std::collections::VecDeque;
use std::convert::Infallible;

/// Values by key. When there are too many, the one made first goes, used or not.
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

    /// The value of a key, if it is there.
    pub fn known(&self, key: &K) -> Option<&T> {
        let of_key = self.kept.iter().find(|(k, _)| k == key);
        of_key.map(|(_, value)| value)
    }

    /// Whether there is one with such a key.
    pub fn any(&self, which: impl Fn(&K) -> bool) -> bool {
        self.kept.iter().any(|(key, _)| which(key))
    }

    /// Whether no more can be added without one going.
    pub fn is_full(&self) -> bool {
        self.kept.len() >= self.most
    }

    /// Forgets some.
    pub fn forget(&mut self, which: impl Fn(&K) -> bool) {
        self.kept.retain(|(key, _)| !which(key));
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.kept.clear();
    }

    /// The value of a key, made now if it is new.
    pub fn get(&mut self, key: K, make: impl FnOnce(&K) -> T) -> &T {
        match self.try_get(key, |key| Ok::<T, Infallible>(make(key))) {
            Ok(value) => value,
            Err(never) => match never {},
        }
    }

    /// The same of what may fail to be made.
    pub fn try_get<E>(&mut self, key: K, make: impl FnOnce(&K) -> Result<T, E>) -> Result<&T, E> {
        let known = self.kept.iter().position(|(k, _)| *k == key);
        let at = match known {
            Some(at) => at,
            None => {
                let made = make(&key)?;
                if self.kept.len() >= self.most {
                    self.kept.pop_front();
                }
                self.kept.push_back((key, made));
                self.kept.len() - 1
            }
        };
        Ok(&self.kept[at].1)
    }
}
