//! The page's own code, put together: HTML, style, shaders and modules in one file.
//!
//! The modules under `page/` are ES modules that import one another. Here they follow one another in one script, in the
//! order in which each uses those before it, without their `import` lines and the word `export`.
//!
//! Not handled: modules that do not keep to that (`docs/explore.md` says how they are written).

/// Where the parts go.
const HTML: &str = include_str!("page/page.html");
const STYLE: &str = include_str!("page/page.css");

/// The shaders, by the names that the page finds them by.
const SHADERS: [(&str, &str); 5] = [
    ("scene.vert", include_str!("page/scene.vert")),
    ("scene.frag", include_str!("page/scene.frag")),
    ("sky.frag", include_str!("page/sky.frag")),
    ("quad.vert", include_str!("page/quad.vert")),
    ("encode.frag", include_str!("page/encode.frag")),
];

/// The modules, each after those that it uses.
const MODULES: [&str; 21] = [
    include_str!("page/words.js"),
    include_str!("page/numbers.js"),
    include_str!("page/transport.js"),
    include_str!("page/state.js"),
    include_str!("page/camera.js"),
    include_str!("page/light.js"),
    include_str!("page/charts.js"),
    include_str!("page/gl.js"),
    include_str!("page/view.js"),
    include_str!("page/bars.js"),
    include_str!("page/square.js"),
    include_str!("page/controls.js"),
    include_str!("page/patches.js"),
    include_str!("page/patch.js"),
    include_str!("page/plan.js"),
    include_str!("page/walk.js"),
    include_str!("page/reflectance.js"),
    include_str!("page/story.js"),
    include_str!("page/app.js"),
    include_str!("page/check.js"),
    include_str!("page/main.js"),
];

/// The page of a document and its numbers.
pub(super) fn joined(title: &str, json: &str, numbers: &str) -> String {
    let shaders = SHADERS.map(|(name, text)| format!("<script type=\"x-shader\" id=\"{name}\">\n{text}</script>"));
    // A tag inside of a string would end the script, or begin another.
    let json = json.replace('<', "\\u003c");
    let data = format!(
        "<script type=\"application/json\" id=\"scene\">{json}</script>\n\
         <script type=\"text/plain\" id=\"numbers\">{numbers}</script>"
    );
    let script: Vec<String> = MODULES.iter().map(|module| without_exports(module)).collect();
    let parts = [
        ("{{title}}", escaped(title)),
        ("{{style}}", format!("<style>\n{STYLE}</style>")),
        ("{{shaders}}", shaders.join("\n")),
        ("{{data}}", data),
        ("{{script}}", format!("<script type=\"module\">\n{}</script>", script.join("\n"))),
    ];
    let mut html = String::with_capacity(numbers.len() + json.len() + (1 << 18));
    let mut rest = HTML;
    for (mark, text) in &parts {
        let Some((before, after)) = rest.split_once(mark) else { continue };
        html.push_str(before);
        html.push_str(text);
        rest = after;
    }
    html + rest
}

/// A module without what joins it to others.
fn without_exports(module: &str) -> String {
    let lines = module.lines().filter(|line| !line.starts_with("import "));
    lines.map(|line| line.strip_prefix("export ").unwrap_or(line).to_owned() + "\n").collect()
}

/// A text as HTML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
