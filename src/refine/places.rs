//! Numbers for some dozens of the elements of a tile, all forgotten at once.
//!
//! A hash table with open addressing that is emptied in constant time: each slot has the stamp of its day. It is as large
//! as what it holds at most, and not as the tile: every thread has some, and in arrays over the tile their memory would
//! grow with both.

/// Elements by index, each with a number.
pub(super) struct Places {
    /// A power of two, at least half of them free.
    slots: Vec<Slot>,
    /// Today's stamp. Day 0 is that of slots that were never written.
    today: u32,
    count: usize,
}

#[derive(Clone, Copy, Default)]
struct Slot {
    day: u32,
    key: u32,
    number: u32,
}

/// Slots at the start: the patch of a line vertex on a city has a hundred faces, on a scan three hundred.
const SLOTS: usize = 1024;

impl Places {
    pub fn new() -> Places {
        Places { slots: vec![Slot::default(); SLOTS], today: 1, count: 0 }
    }

    /// Nothing has a number.
    pub fn forget(&mut self) {
        if self.today == u32::MAX {
            self.slots.fill(Slot::default());
            self.today = 0;
        }
        self.today += 1;
        self.count = 0;
    }

    /// Gives `key` this number if it has none, and says so.
    #[inline]
    pub fn put_first(&mut self, key: u32, number: u32) -> bool {
        let i = self.find(key);
        let slot = &mut self.slots[i];
        let first = slot.day != self.today;
        // Without a branch: which way it goes cannot be guessed.
        *slot = if first { Slot { day: self.today, key, number } } else { *slot };
        self.count += usize::from(first);
        if 2 * self.count > self.slots.len() {
            self.grow();
        }
        first
    }

    /// Gives `key` this number, whether it has one or not.
    pub fn put(&mut self, key: u32, number: u32) {
        if !self.put_first(key, number) {
            let i = self.find(key);
            self.slots[i].number = number;
        }
    }

    /// The number of `key`, `otherwise` if it has none.
    #[inline]
    pub fn get_or(&self, key: u32, otherwise: u32) -> u32 {
        let slot = self.slots[self.find(key)];
        if slot.day == self.today { slot.number } else { otherwise }
    }

    /// Where `key` is or would be.
    #[inline]
    fn find(&self, key: u32) -> usize {
        let mask = self.slots.len() - 1;
        // Fibonacci hashing: the upper bits of a multiple of the golden ratio.
        let mut i = (u64::from(key.wrapping_mul(0x9e37_79b9)) * self.slots.len() as u64 >> 32) as usize;
        while self.slots[i].day == self.today && self.slots[i].key != key {
            i = (i + 1) & mask;
        }
        i
    }

    #[cold]
    fn grow(&mut self) {
        let larger = vec![Slot::default(); 2 * self.slots.len()];
        for slot in std::mem::replace(&mut self.slots, larger).into_iter().filter(|slot| slot.day == self.today) {
            let i = self.find(slot.key);
            self.slots[i] = slot;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    #[test]
    fn numbers_are_found_until_they_are_forgotten() {
        let (mut places, mut expected) = (Places::new(), HashMap::new());
        for day in 0..5u32 {
            places.forget();
            expected.clear();
            for i in 0..3000u32 << day {
                let key = i.wrapping_mul(1 << 20).wrapping_add(i % 977);
                assert_eq!(places.put_first(key, i), !expected.contains_key(&key));
                expected.entry(key).or_insert(i);
            }
            places.put(5, 17);
            expected.insert(5, 17);
            for key in (0..10_000).chain(expected.keys().copied().collect::<Vec<_>>()) {
                assert_eq!(places.get_or(key, u32::MAX), expected.get(&key).copied().unwrap_or(u32::MAX));
            }
        }
    }

    #[test]
    fn the_last_day_is_followed_by_the_first() {
        let mut places = Places::new();
        places.put(3, 1);
        places.today = u32::MAX;
        places.put(4, 1);
        places.forget();
        assert_eq!([3, 4].map(|key| places.get_or(key, 9)), [9, 9]);
    }
}
