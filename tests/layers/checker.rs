//! Tests of the checks themselves: they must find violations, and accept code without any.

use super::*;

const ORDER: [&str; 3] = ["low", "middle", "high"];

fn in_middle(source: &str) -> Vec<&str> {
    violations(&ORDER, "middle", &tokens(source), 2)
}

#[test]
fn finds_a_use_of_a_module_below() {
    assert_eq!(in_middle("use crate::high::Thing;"), ["high"]);
    assert_eq!(in_middle("fn f() { crate::high::g(&crate::low::X) }"), ["high"]);
    assert_eq!(in_middle("use crate::{low::{A, high}, middle, high::{self, B}};"), ["high"]);
    assert_eq!(in_middle("use super::super::high;"), ["high"]);
    assert_eq!(in_middle("macro_rules! m { () => { $crate::high::X } }"), ["high"]);
    assert_eq!(in_middle("fn f<'a>() -> &'a str { \"\\\"\" } use crate::high::X; // '\"'"), ["high"]);
}

#[test]
fn accepts_uses_of_modules_above_and_of_the_module_itself() {
    assert!(in_middle("use crate::low::{A, B}; use crate::middle::C; use super::high; use crate::LOWEST;").is_empty());
    assert!(in_middle("mod tests { use super::super::high; }").is_empty());
}

#[test]
fn does_not_read_comments_and_strings() {
    assert!(in_middle("/// [`crate::high::X`]\n/* crate::high /* */ unsafe */ fn f() {}").is_empty());
    for text in ["\"unsafe\"", "r#\"an \" unsafe\"#", "b\"unsafe\"", "// unsafe", "'\"' /* \" */ // unsafe"] {
        assert!(!tokens(text).contains(&"unsafe"), "{text}");
    }
    assert!(tokens("let x = 'a'; unsafe { f(\"\\\\\") }").contains(&"unsafe"));
    assert!(tokens("fn f<'a>(x: &'a str) { unsafe { g('\\'', br\"\\\") } }").contains(&"unsafe"));
}

#[test]
fn finds_what_is_taken_from_a_motion_chip() {
    let found = |source| named_of_motion_chips(&tokens(source)).join(" ");
    assert_eq!(found("use crate::chip::tmc429::{Register, Tmc429, reference};"), "Register reference");
    assert_eq!(found("fn f() { chip::tmc262::flags::SHORT_A }"), "flags");
    assert_eq!(found("use crate::chip::{at25, tmc429};"), "tmc429");
    assert_eq!(found("use crate::chip::tmc262::Tmc262; use crate::chip::encoder::{Counter, TURN};"), "");
}

/// The folder with these files of a crate.
fn written(name: &str, files: &[(&str, &str)]) -> PathBuf {
    let folder = xtask::programs().unwrap().join("layers").join(name);
    for (path, text) in files {
        let path = folder.join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    folder
}

/// The imports between the files of a crate, written as "file -> file".
fn imports_of(name: &str, files: &[(&str, &str)]) -> Vec<String> {
    let folder = written(name, files);
    let imports = imports::Crate::read(&folder.join("lib.rs")).imports();
    let short = |path: &Path| path.strip_prefix(&folder).unwrap().display().to_string();
    let lines = imports.iter().flat_map(|(from, others)| others.keys().map(move |to| (from, to)));
    lines.map(|(from, to)| format!("{} -> {}", short(from), short(to))).collect()
}

/// Each way to name an item of `b.rs` whose parent module re-exports it.
#[test]
fn follows_every_path_to_the_file_that_defines() {
    let parent = "mod a; mod b; mod e; pub use b::{Thing, function as other};";
    for (number, source) in [
        "use super::b::Thing;",
        "use super::Thing;",
        "use crate::m::Thing as Other;",
        "use crate::{m::{self, a}, x}; fn f() { m::other() }",
        "use super::*; fn f() -> Thing { 0 }",
        "use super::b::*;",
        "fn f() { super::other() }",
        "fn f(x: crate::m::Thing) {}",
        "fn f() -> Vec<super::b::Thing> { x }",
        "mod tests { use super::super::Thing; }",
        "mod tests { fn f() { crate::m::b::function() } }",
        "use super::e::Thing;",
    ]
    .iter()
    .enumerate()
    {
        let files = [
            ("lib.rs", "mod m;"),
            ("m/mod.rs", parent),
            ("m/a.rs", source),
            ("m/b.rs", "pub struct Thing; pub fn function() {}"),
            ("m/e.rs", "pub(super) use super::b::Thing;"),
        ];
        let imports = imports_of(&format!("names{number}"), &files);
        assert!(imports.contains(&"m/a.rs -> m/b.rs".into()), "{source}: {imports:?}");
    }
}

#[test]
fn a_child_is_part_of_its_parent_but_not_of_others() {
    let files = [
        ("lib.rs", "mod m; pub use m::Own;"),
        ("m.rs", "mod a; pub use a::Part; pub struct Own; /* Part */"),
        ("m/a.rs", "mod deep; use super::Own; pub struct Part; mod tests { use super::*; }"),
        ("m/a/deep.rs", "use crate::Own; use std::fmt;"),
    ];
    assert_eq!(imports_of("parts", &files), ["m/a/deep.rs -> m.rs"]);
    let files = [
        ("lib.rs", "#[path = \"other/place.rs\"] mod m;"),
        ("other/place.rs", "mod a; pub use a::Part; pub fn f(_: Part) {}"),
        ("other/a.rs", "pub struct Part;"),
    ];
    assert_eq!(imports_of("mention", &files), ["other/place.rs -> other/a.rs"]);
}

#[test]
fn finds_circles_and_nothing_else() {
    let imports = |pairs: &[(&str, &str)]| {
        let mut imports = circles::Imports::new();
        for (from, to) in pairs {
            imports.entry(from.into()).or_default().insert(to.into(), "Thing".into());
        }
        imports
    };
    assert!(circles::circles(&imports(&[("a", "b"), ("b", "c"), ("a", "c")])).is_empty());
    let found = imports(&[("a", "b"), ("b", "c"), ("c", "a"), ("c", "d"), ("x", "a"), ("d", "e"), ("e", "d")]);
    let pairs = |circle: &Vec<(&Path, &Path, &str)>| -> Vec<String> {
        circle.iter().map(|(from, to, _)| format!("{}{}", from.display(), to.display())).collect()
    };
    let found: Vec<_> = circles::circles(&found).iter().map(pairs).collect();
    assert_eq!(found, [vec!["ab", "bc", "ca"], vec!["de", "ed"]]);
}

#[test]
fn finds_uses_of_a_floor_below() {
    let files = [
        ("lib.rs", "mod board; mod other; pub struct Thing;"),
        ("other.rs", "use crate::board::Shared;"),
        ("board/mod.rs", "mod low; mod high; pub use high::Top; pub struct Shared;"),
        ("board/low/mod.rs", "pub(super) mod a; pub(super) mod b;"),
        (
            "board/low/a.rs",
            "use super::b::B; use crate::Thing; use crate::board::Top; use crate::board::Shared; pub struct A;",
        ),
        ("board/low/b.rs", "pub struct B; mod tests { fn f() { super::super::super::high::d::function() } }"),
        ("board/high/mod.rs", "mod c; mod d; pub use c::Top;"),
        ("board/high/c.rs", "use crate::board::low::a::A; use super::d::function; pub struct Top(A);"),
        ("board/high/d.rs", "pub fn function() {}"),
    ];
    let folder = written("floors", &files);
    let board = folder.join("board");
    let imports = imports::Crate::read(&folder.join("lib.rs")).imports();
    let short = |path: &Path| path.strip_prefix(&board).unwrap().display().to_string();
    let upward = upward(&board, &["low", "high"], &imports);
    let found: Vec<_> = upward.iter().map(|(from, to, _)| format!("{} -> {}", short(from), short(to))).collect();
    assert_eq!(found, ["low/a.rs -> high/c.rs", "low/a.rs -> mod.rs", "low/b.rs -> high/d.rs"]);
}

/// The types of a crate with their methods: "type: files", and the calls between these as "file -> file: methods".
fn owners_of(name: &str, files: &[(&str, &str)]) -> Vec<String> {
    let folder = written(name, files);
    let short = |path: &Path| path.strip_prefix(&folder).unwrap().with_extension("").display().to_string();
    let mut lines = Vec::new();
    for (path, owner) in owners::owners(&folder.join("lib.rs")) {
        let files: Vec<_> = owner.files().into_iter().map(short).collect();
        lines.push(format!("{}: {}", path.join("::"), files.join(" ")));
        let calls = owner.calls.iter().flat_map(|(from, others)| others.iter().map(move |to| (from, to)));
        lines.extend(calls.map(|(from, (to, names))| format!("{} -> {}: {names}", short(from), short(to))));
    }
    lines
}

#[test]
fn finds_calls_of_own_methods_both_ways() {
    let files = [
        ("lib.rs", "mod a; mod b; pub struct Node<T>(T);"),
        (
            "a.rs",
            "use crate::Node; impl<T> Node<T> { fn a(&self) { self.b() } fn d(&self) { if self.0 { (&*self).b() } } }",
        ),
        ("b.rs", "impl<T> super::Node<T> { fn b(&self) { Self::a(self); matches!(self.d(), 1); } }"),
    ];
    assert_eq!(owners_of("both", &files), ["Node: a b", "a -> b: b", "b -> a: a, d"]);
    let owners = owners::owners(&written("both", &files).join("lib.rs"));
    let circles = circles::circles(&owners[&vec!["Node".to_owned()]].calls);
    assert_eq!(circles.iter().map(|circle| circles::files(circle).len()).collect::<Vec<_>>(), [2]);
}

#[test]
fn a_function_that_changes_a_type_is_a_method() {
    let files = [
        ("lib.rs", "mod a; mod b; mod c;"),
        (
            "a.rs",
            "pub struct Node; impl Node { pub fn a(&mut self) { let own = self; crate::b::change(own); own.d() } }",
        ),
        (
            "b.rs",
            "use crate::a::Node; pub fn change(node: &mut Node) { node.a(); } pub fn look(node: &Node) { node.a() }",
        ),
        ("c.rs", "use crate::a::Node as It; impl It { fn d(&self) { each(|one: &Self| one.a(), Self::a) } }"),
    ];
    assert_eq!(owners_of("free", &files), ["a::Node: a b c", "a -> b: change", "a -> c: d", "b -> a: a", "c -> a: a"]);
}

#[test]
fn types_of_one_name_are_told_apart() {
    let files = [
        ("lib.rs", "mod a; mod b; mod c; pub use b::*;"),
        ("a.rs", "mod more; pub struct Node; impl Node { fn a(&self) { self.c() } }"),
        ("a/more.rs", "use super::Node; impl Node { fn more(&self) { self.a() } }"),
        (
            "b.rs",
            "pub struct Node; impl Node { fn b(&self) { self.c() } } mod inner { pub struct Node; impl Node { fn i(&self) {} } }",
        ),
        ("c.rs", "use crate::Node; impl Node { fn c(&self) {} }"),
    ];
    let found = ["a::Node: a/more a", "a/more -> a: a", "b::Node: b c", "b -> c: c", "b::inner::Node: b"];
    assert_eq!(owners_of("names", &files), found);
}

#[test]
fn tests_and_traits_do_not_count() {
    let files = [
        (
            "lib.rs",
            "mod a; mod b; #[cfg(test)] mod tests; pub struct Node; impl Node { fn own(&self) { self.a(); x.b() } }",
        ),
        (
            "a.rs",
            "use crate::Node; impl Clone for Node { fn a(&self) { self.own() } } fn f<T: Do>(_: &mut T, _: &Node) {}",
        ),
        ("b.rs", "#[cfg(test)] mod tests { use crate::Node; impl Node { fn b(&self) { self.own() } } }"),
        ("tests.rs", "use crate::Node; impl Node { fn a(&self) { self.own() } }"),
    ];
    assert_eq!(owners_of("apart", &files), ["Node: lib"]);
}

#[test]
fn reads_the_order_from_the_root() {
    assert_eq!(
        declared(&tokens("//! mod no;\npub mod low;\n#[cfg(x)]\nmod middle;\nmod tests { }")),
        ["low", "middle"]
    );
}
