//! Which parameters a client asks for: names are dotted, and a prefix stands for all below it.

/// Whether `name` is asked for by `prefixes` (all, where there are none), at most `depth` levels deep (0: however deep).
pub fn within_prefixes(name: &str, prefixes: &[String], depth: u64) -> bool {
    let shallow = |below: &str| depth == 0 || (below.matches('.').count() as u64) < depth;
    if prefixes.is_empty() {
        return shallow(name);
    }
    prefixes.iter().any(|prefix| {
        let below = name.strip_prefix(prefix.as_str());
        below.is_some_and(|below| below.is_empty() || below.strip_prefix('.').is_some_and(shallow))
    })
}

/// Names, and the prefixes that occur in them, each once.
pub fn as_listed(names: Vec<String>) -> (Vec<String>, Vec<String>) {
    let mut prefixes: Vec<String> = Vec::new();
    for (prefix, _) in names.iter().filter_map(|name| name.rsplit_once('.')) {
        if prefixes.iter().all(|known| known != prefix) {
            prefixes.push(prefix.to_owned());
        }
    }
    (names, prefixes)
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: [&str; 4] = ["seed", "filter.particles", "filter.paper.lambda", "filters"];

    fn listed(prefixes: &[&str], depth: u64) -> Vec<&'static str> {
        let prefixes: Vec<_> = prefixes.iter().map(|prefix| prefix.to_string()).collect();
        let wanted = |name: &&str| within_prefixes(name, &prefixes, depth);
        NAMES.into_iter().filter(wanted).collect()
    }

    #[test]
    fn prefix_and_depth_choose() {
        assert_eq!(listed(&[], 0), NAMES);
        assert_eq!(listed(&[], 1), ["seed", "filters"]);
        assert_eq!(listed(&["filter"], 0), NAMES[1..3]);
        assert_eq!(listed(&["filter"], 1), NAMES[1..2]);
        assert_eq!(
            listed(&["seed", "filter.paper"], 1),
            ["seed", "filter.paper.lambda"]
        );
    }

    #[test]
    fn each_prefix_is_listed_once() {
        let names = ["a.b.x", "a.b.y", "a.z", "seed"]
            .map(str::to_owned)
            .to_vec();
        assert_eq!(
            as_listed(names.clone()),
            (names, vec!["a.b".to_owned(), "a".to_owned()])
        );
    }
}
