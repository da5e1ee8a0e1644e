// Build the script and the style of the page: npm ci && npm run build.
//
// The result is package data of gso, and committed. built.json has the digest of the sources, so
// that a test can tell whether they were built after their last change.

import { createHash } from "node:crypto";
import { copyFileSync, mkdirSync, readFileSync, readdirSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

import { build } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const out = join(here, "..", "gso", "workshop", "web");
mkdirSync(out, { recursive: true });

// Nothing on the page may name an address: messages of three.js do.
const withoutAddresses = {
  name: "without-addresses",
  setup(bundler) {
    bundler.onLoad({ filter: /node_modules[\\/]three[\\/].*\.js$/ }, ({ path }) => ({
      contents: readFileSync(path, "utf-8").replace(
        /https?:\/\/(?!www\.w3\.org)[^\s"'`)]*/g,
        "the manual of three.js",
      ),
    }));
  },
};

const common = { bundle: true, minify: true, legalComments: "none", charset: "ascii", logLevel: "warning" };
await build({
  ...common,
  entryPoints: [join(here, "src", "main.js")],
  outfile: join(out, "page.js"),
  format: "iife",
  target: "es2020",
  // A page may hold the script only if it does not end there.
  supported: { "inline-script": false },
  plugins: [withoutAddresses],
});
await build({ ...common, entryPoints: [join(here, "src", "boot.js")], outfile: join(out, "boot.js"), format: "iife", target: "es2020" });
await build({ ...common, entryPoints: [join(here, "src", "page.css")], outfile: join(out, "page.css") });
copyFileSync(join(here, "node_modules", "three", "LICENSE"), join(out, "LICENSE-three.txt"));

const digest = createHash("sha256");
const sources = ["build.mjs", "package-lock.json", "package.json"];
for (const name of readdirSync(join(here, "src"))) sources.push(`src/${name}`);
for (const name of sources.sort()) {
  digest.update(`${name}\n`);
  digest.update(readFileSync(join(here, name)));
}
const packages = JSON.parse(readFileSync(join(here, "package.json"), "utf-8")).devDependencies;
const files = {};
for (const name of ["boot.js", "page.js", "page.css", "LICENSE-three.txt"])
  files[name] = createHash("sha256").update(readFileSync(join(out, name))).digest("hex");
const said = { sources: digest.digest("hex"), files, packages };
writeFileSync(join(out, "built.json"), JSON.stringify(said, null, 2) + "\n");
