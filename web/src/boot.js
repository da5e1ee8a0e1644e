// Unpack the script of the page and run it. Scripts and numbers are stored compressed: zlib, base64.

const NOTICE = "This browser cannot show the parts in space; the pictures below show them in their places.";

async function unpack(id) {
  const text = document.getElementById(id).textContent;
  const bytes = Uint8Array.from(atob(text.trim()), (c) => c.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate")));
}

// For the script.
window.gsoUnpack = unpack;

(async () => {
  try {
    const script = document.createElement("script");
    script.textContent = await (await unpack("page-script")).text();
    document.head.append(script);
  } catch (error) {
    console.warn(error);
    document.getElementById("viewer").textContent = NOTICE;
  }
})();
