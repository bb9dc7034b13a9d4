//! Folders of WGSL files, and linking them.

use std::{
    borrow::Cow,
    fs,
    path::{Path, PathBuf},
};

use wesl::{FileResolver, ModulePath, ResolveError, Resolver, Wesl, syntax::GlobalDeclaration};

use crate::{
    Error, Shader,
    reflect::{IMPORTED, reflect},
};

/// A folder of WGSL files, and folders whose modules they may import.
#[derive(Clone, Debug)]
pub struct Sources {
    /// The first folder that has a module provides it.
    folders: Vec<PathBuf>,
}

impl Sources {
    /// The WGSL files of a folder.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folders: vec![folder.into()] }
    }

    /// Imports that this folder lacks are looked for in another one, under the same paths.
    pub fn or_from(mut self, folder: impl Into<PathBuf>) -> Self {
        self.folders.push(folder.into());
        self
    }

    /// Names of all shaders of the first folder, each with every combination of its features, sorted by file.
    ///
    /// # Errors
    /// Where a folder or file cannot be read.
    pub fn shader_names(&self) -> Result<Vec<String>, Error> {
        let mut names = Vec::new();
        let folder = &self.folders[0];
        for file in wgsl_files(folder)? {
            let text = read(&file)?;
            if ["@compute", "@vertex", "@fragment"].iter().any(|stage| text.contains(stage)) {
                let path = file.strip_prefix(folder).unwrap_or(&file).with_extension("");
                let name = path.to_string_lossy().replace('\\', "/");
                names.extend(combinations(&features_of(&text)).into_iter().map(|features| name.clone() + &features));
            }
        }
        Ok(names)
    }

    /// Features that a shader file declares, by the file's name, for example `hierarchical/gather`.
    ///
    /// # Errors
    /// Where the file cannot be read.
    pub fn features(&self, file: &str) -> Result<Vec<String>, Error> {
        Ok(features_of(&read(&self.folders[0].join(file).with_extension("wgsl"))?))
    }

    /// Every folder and file that a change of the set of shaders may come from.
    ///
    /// # Errors
    /// Where a folder cannot be read.
    pub fn watched(&self) -> Result<Vec<PathBuf>, Error> {
        let mut paths = Vec::new();
        for folder in &self.folders {
            walk(folder, &mut paths)?;
        }
        paths.sort();
        Ok(paths)
    }

    /// Links, validates and describes the shader of this name, for example `direct/direct_light+emitters`.
    ///
    /// # Errors
    /// A message for people, with file and line where they are known.
    pub fn compile(&self, name: &str) -> Result<Shader, Error> {
        let mut words = name.split('+');
        let file = words.next().unwrap_or_default();
        let module: ModulePath =
            format!("package::{}", file.replace('/', "::")).parse().map_err(|_| Error::Name(name.to_owned()))?;
        let resolver = Folders(self.folders.iter().map(FileResolver::new).collect());
        let mut compiler = Wesl::new("").set_custom_resolver(resolver);
        compiler.set_missing_feature_behavior(false);
        for feature in words {
            compiler.set_feature(feature, true);
        }
        let mut linked = compiler
            .compile(&module)
            .map_err(|error| Error::Link { shader: name.to_owned(), message: without_colours(&error.to_string()) })?;
        // The linker visits imported modules in a random order; sorted, the same files always give the same text. Names of
        // the shader's own declarations stay as they are and keep their order, first.
        linked.syntax.global_declarations.sort_by_key(|declaration| imported_name(declaration));
        let mut files: Vec<PathBuf> =
            linked.modules.iter().filter_map(|module| compiler.resolver().fs_path(module)).collect();
        files.sort();
        files.dedup();
        let (source, shader) = (linked.to_string(), name.to_owned());
        match reflect(&source) {
            Ok((entry_points, overrides)) => Ok(Shader { name: shader, source, files, entry_points, overrides }),
            Err(message) => Err(Error::Invalid { shader, message }),
        }
    }
}

/// Text without the escape sequences with which the linker colours its messages for terminals.
fn without_colours(text: &str) -> String {
    anstream::adapter::strip_str(text).to_string()
}

/// Name of a declaration that comes from an imported module.
fn imported_name(declaration: &GlobalDeclaration) -> Option<String> {
    let ident = match declaration {
        GlobalDeclaration::Declaration(variable) => &variable.ident,
        GlobalDeclaration::TypeAlias(alias) => &alias.ident,
        GlobalDeclaration::Struct(structure) => &structure.ident,
        GlobalDeclaration::Function(function) => &function.ident,
        GlobalDeclaration::Void | GlobalDeclaration::ConstAssert(_) => return None,
    };
    Some(ident.to_string()).filter(|name| name.starts_with(IMPORTED))
}

/// Looks for a module in one folder after another.
struct Folders(Vec<FileResolver>);

impl Folders {
    fn of(&self, path: &ModulePath) -> &FileResolver {
        self.0.iter().find(|folder| folder.fs_path(path).is_some()).unwrap_or(&self.0[0])
    }
}

impl Resolver for Folders {
    fn resolve_source<'a>(&'a self, path: &ModulePath) -> Result<Cow<'a, str>, ResolveError> {
        self.of(path).resolve_source(path)
    }

    fn display_name(&self, path: &ModulePath) -> Option<String> {
        self.of(path).display_name(path)
    }

    fn fs_path(&self, path: &ModulePath) -> Option<PathBuf> {
        self.of(path).fs_path(path)
    }
}

/// Features that the first line of a file declares.
fn features_of(text: &str) -> Vec<String> {
    text.lines()
        .next()
        .and_then(|line| line.strip_prefix("// variants:"))
        .map(|list| list.split(',').map(|name| name.trim().to_owned()).collect())
        .unwrap_or_default()
}

/// Every subset of the features, written `+a+b`; the empty one first.
fn combinations(features: &[String]) -> Vec<String> {
    let subset = |bits: usize| {
        let chosen = features.iter().enumerate().filter(|(i, _)| bits >> i & 1 == 1);
        chosen.map(|(_, feature)| format!("+{feature}")).collect()
    };
    (0..1usize << features.len()).map(subset).collect()
}

fn read(file: &Path) -> Result<String, Error> {
    fs::read_to_string(file).map_err(|error| Error::Read { path: file.to_owned(), error })
}

fn wgsl_files(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let mut paths = Vec::new();
    walk(folder, &mut paths)?;
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "wgsl"));
    paths.sort();
    Ok(paths)
}

/// The folder, the folders in it and their WGSL files.
fn walk(folder: &Path, paths: &mut Vec<PathBuf>) -> Result<(), Error> {
    let unreadable = |error| Error::Read { path: folder.to_owned(), error };
    paths.push(folder.to_owned());
    for entry in fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        if path.is_dir() {
            walk(&path, paths)?;
        } else if path.extension().is_some_and(|ending| ending == "wgsl") {
            paths.push(path);
        }
    }
    Ok(())
}
