import { defineConfig } from "vite";

// The page, and the worker that holds the agent; PANGEA_PAGE_OUT is where CMake wants them. No data: URLs, so that the
// server's content security policy can stay narrow. The agent itself (pangea_agent.mjs, .wasm) lies beside them and is
// loaded when the worker starts.
export default defineConfig({
  worker: { format: "es" },
  build: {
    target: "es2022",
    outDir: process.env.PANGEA_PAGE_OUT ?? "dist",
    emptyOutDir: true,
    assetsInlineLimit: 0,
    chunkSizeWarningLimit: 1000,
  },
});
