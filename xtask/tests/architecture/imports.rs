//! Which module of a crate imports which, found in its sources.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

use proc_macro2::{TokenStream, TokenTree};
use syn::{
    Attribute, Item, ItemMod, ItemUse, Macro, UseTree,
    visit::{self, Visit},
};

/// For each module with a file of its own, by its path (`a::b`; the root is empty), the modules that it imports.
pub type Graph = BTreeMap<String, BTreeSet<String>>;

/// The graph of the crate with this root file. Tests inside of files count for nothing.
pub fn graph(root: &Path) -> Graph {
    let mut files = BTreeMap::new();
    read(root, &[], root.parent().unwrap(), &mut files);
    let mut graph = Graph::new();
    for (name, paths) in &files {
        // The longest beginning of a path that is a file.
        let file_of = |path: &Vec<String>| {
            (0..=path.len()).rev().map(|length| path[..length].join("::")).find(|module| files.contains_key(module))
        };
        graph.insert(name.clone(), paths.iter().filter_map(file_of).filter(|module| module != name).collect());
    }
    graph
}

/// Groups of sibling modules, each taken with everything below it, that import one another in a circle. Imports between a
/// module and what is below it do not count.
pub fn circles(graph: &Graph) -> Vec<Vec<String>> {
    let mut edges: Graph = BTreeMap::new();
    for (from, imports) in graph {
        for to in imports {
            let (a, b): (Vec<&str>, Vec<&str>) = (parts(from), parts(to));
            let common = a.iter().zip(&b).take_while(|(a, b)| a == b).count();
            if common < a.len() && common < b.len() {
                edges.entry(a[..=common].join("::")).or_default().insert(b[..=common].join("::"));
            }
        }
    }
    let reached: BTreeMap<&String, BTreeSet<String>> = edges.keys().map(|from| (from, reach(&edges, from))).collect();
    let mut circles = BTreeSet::new();
    for (from, all) in &reached {
        let circle: Vec<String> =
            all.iter().filter(|to| reached.get(to).is_some_and(|back| back.contains(*from))).cloned().collect();
        if circle.len() > 1 {
            circles.insert(circle);
        }
    }
    circles.into_iter().collect()
}

/// The imports between the modules of a circle.
pub fn within(graph: &Graph, circle: &[String]) -> Vec<String> {
    let group = |module: &str| circle.iter().position(|c| module == c || module.starts_with(&format!("{c}::")));
    let mut all = Vec::new();
    for (from, imports) in graph {
        for to in imports {
            if let (Some(a), Some(b)) = (group(from), group(to))
                && a != b
            {
                all.push(format!("{from} imports {to}"));
            }
        }
    }
    all
}

fn parts(module: &str) -> Vec<&str> {
    module.split("::").filter(|part| !part.is_empty()).collect()
}

fn reach(edges: &Graph, from: &str) -> BTreeSet<String> {
    let (mut reached, mut open) = (BTreeSet::new(), vec![from.to_owned()]);
    while let Some(next) = open.pop() {
        for to in edges.get(&next).into_iter().flatten() {
            if reached.insert(to.clone()) {
                open.push(to.clone());
            }
        }
    }
    reached
}

/// Reads a module's file and those of its children; notes the paths of the crate that each one names.
fn read(file: &Path, module: &[String], children: &Path, files: &mut BTreeMap<String, BTreeSet<Vec<String>>>) {
    let text = fs::read_to_string(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let syntax = syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let mut reader = Reader { module: module.to_vec(), paths: BTreeSet::new(), children: Vec::new() };
    reader.visit_file(&syntax);
    files.insert(module.join("::"), reader.paths);
    for child in reader.children {
        let folder = children.join(&child);
        let module: Vec<String> = module.iter().cloned().chain([child.clone()]).collect();
        let plain = children.join(format!("{child}.rs"));
        let file = if plain.exists() { plain } else { folder.join("mod.rs") };
        read(&file, &module, &folder, files);
    }
}

struct Reader {
    /// The module whose items are being read, which may be an inline one of the file.
    module: Vec<String>,
    paths: BTreeSet<Vec<String>>,
    /// Modules with files of their own.
    children: Vec<String>,
}

impl Reader {
    /// Notes a path where it begins with `crate`, `self` or `super`, or with a child.
    fn note(&mut self, path: &[String]) {
        let mut module = self.module.clone();
        let mut rest = path;
        match path.first().map(String::as_str) {
            Some("crate") => (module, rest) = (Vec::new(), &path[1..]),
            Some("self") => rest = &path[1..],
            Some("super") => {}
            Some(first) if self.children.iter().any(|child| child == first) => {}
            _ => return,
        }
        while rest.first().is_some_and(|word| word == "super") {
            module.pop();
            rest = &rest[1..];
        }
        module.extend(rest.iter().cloned());
        self.paths.insert(module);
    }

    fn note_use(&mut self, tree: &UseTree, before: &[String]) {
        let with = |word: String| before.iter().cloned().chain([word]).collect::<Vec<_>>();
        match tree {
            UseTree::Path(path) => self.note_use(&path.tree, &with(path.ident.to_string())),
            UseTree::Name(name) if name.ident == "self" => self.note(before),
            UseTree::Name(name) => self.note(&with(name.ident.to_string())),
            UseTree::Rename(name) => self.note(&with(name.ident.to_string())),
            UseTree::Glob(_) => self.note(before),
            UseTree::Group(group) => group.items.iter().for_each(|tree| self.note_use(tree, before)),
        }
    }

    /// Paths among the tokens of a macro: `crate :: word :: word`.
    fn note_tokens(&mut self, tokens: TokenStream) {
        let mut path: Vec<String> = Vec::new();
        let mut colons = 0;
        for token in tokens {
            match token {
                TokenTree::Ident(word) if colons == 2 => path.push(word.to_string()),
                TokenTree::Ident(word) => {
                    self.note(&path);
                    path = vec![word.to_string()];
                }
                TokenTree::Punct(punct) if punct.as_char() == ':' && !path.is_empty() => {
                    colons += 1;
                    continue;
                }
                TokenTree::Group(group) => {
                    self.note(&path);
                    path.clear();
                    self.note_tokens(group.stream());
                }
                _ => {
                    self.note(&path);
                    path.clear();
                }
            }
            colons = 0;
        }
        self.note(&path);
    }
}

fn is_test(attributes: &[Attribute]) -> bool {
    let says_test = |attribute: &Attribute| {
        attribute.path().is_ident("test")
            || attribute.path().is_ident("cfg")
                && attribute.meta.require_list().is_ok_and(|list| list.tokens.to_string() == "test")
    };
    attributes.iter().any(says_test)
}

impl Visit<'_> for Reader {
    fn visit_file(&mut self, file: &syn::File) {
        // Children first: paths may begin with their names.
        let child = |item: &Item| match item {
            Item::Mod(item) if item.content.is_none() && !is_test(&item.attrs) => Some(item.ident.to_string()),
            _ => None,
        };
        self.children = file.items.iter().filter_map(child).collect();
        visit::visit_file(self, file);
    }

    fn visit_item_mod(&mut self, item: &ItemMod) {
        if is_test(&item.attrs) {
            return;
        }
        if item.content.is_some() {
            self.module.push(item.ident.to_string());
            visit::visit_item_mod(self, item);
            self.module.pop();
        }
    }

    fn visit_item_fn(&mut self, item: &syn::ItemFn) {
        if !is_test(&item.attrs) {
            visit::visit_item_fn(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &ItemUse) {
        if !is_test(&item.attrs) {
            self.note_use(&item.tree, &[]);
        }
    }

    fn visit_path(&mut self, path: &syn::Path) {
        let words: Vec<String> = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        self.note(&words);
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, item: &Macro) {
        self.note_tokens(item.tokens.clone());
        visit::visit_macro(self, item);
    }
}
