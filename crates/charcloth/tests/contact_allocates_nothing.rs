//! A query whose buffers have grown asks the system for no memory.

use charcloth::contact::{Contacts, Surface};
use glam::DVec3;
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

static COUNT: AtomicUsize = AtomicUsize::new(0);

struct Counting;

// SAFETY: every call goes on to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.fetch_add(1, Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

#[test]
fn a_later_query_allocates_nothing() {
    let n = 40;
    let at = |i: usize, j: usize| (i * (n + 1) + j) as u32;
    let (mut before, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..=n {
        for j in 0..=n {
            let floor = (j as f64).rem_euclid(8.0);
            before.push(DVec3::new(if floor < 4.0 { floor } else { 8.0 - floor }, i as f64, 0.1 * j as f64));
            if i < n && j < n {
                triangles
                    .extend([[at(i, j), at(i, j + 1), at(i + 1, j)], [at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)]]);
            }
        }
    }
    let after: Vec<DVec3> = before.iter().map(|p| *p + DVec3::new(0.0, 0.0, 0.3 * (p.x + p.y).sin())).collect();
    let surface = Surface::sheet(before.len(), &triangles, 1e-4).unwrap();
    let mut contacts = Contacts::build(surface, &before);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        let mut queries = || {
            assert!(!contacts.detect(&before, 0.7).0.is_empty());
            assert!(!contacts.continuous(&before, &after, 0.01).is_empty());
            assert!(!contacts.passed_through(&before, &after).is_empty());
            contacts.largest_safe_step(&before, &after, 0.01);
            contacts.intersecting_pairs(&after);
        };
        // Two buffers change places as the walk is planned: both must have grown.
        (0..3).for_each(|_| queries());
        let count = COUNT.load(Ordering::Relaxed);
        queries();
        assert_eq!(COUNT.load(Ordering::Relaxed) - count, 0);
    });
}
