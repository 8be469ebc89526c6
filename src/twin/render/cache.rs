//! The latest few of what is costly to make.

use std::collections::VecDeque;
use std::convert::Infallible;

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
