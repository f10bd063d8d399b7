import { defineConfig } from "vite";

// One page, one script, one style sheet; PANGEA_PAGE_OUT is where CMake wants them. No data: URLs,
// so that the server's content security policy can stay narrow.
export default defineConfig({
  build: {
    outDir: process.env.PANGEA_PAGE_OUT ?? "dist",
    emptyOutDir: true,
    assetsInlineLimit: 0,
    chunkSizeWarningLimit: 1000,
  },
});
