//! Lists of different lengths, one after the other in memory.

/// Many short lists in one allocation.
pub(crate) struct Lists<T> {
    /// Where each list starts in `items`, and where the last one ends.
    start: Vec<u32>,
    items: Vec<T>,
}

impl<T> Default for Lists<T> {
    fn default() -> Self {
        Self {
            start: vec![0],
            items: Vec::new(),
        }
    }
}

impl<T> Lists<T> {
    /// Adds a list.
    pub(crate) fn push(&mut self, list: impl IntoIterator<Item = T>) {
        self.items.extend(list);
        self.start.push(self.items.len() as u32);
    }

    /// The list with this index.
    #[inline]
    pub(crate) fn get(&self, index: usize) -> &[T] {
        &self.items[self.start[index] as usize..self.start[index + 1] as usize]
    }
}
