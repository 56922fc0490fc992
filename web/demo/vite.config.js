import { defineConfig } from 'vite';

// What a page needs to run threads that share memory.
const isolated = { 'Cross-Origin-Opener-Policy': 'same-origin', 'Cross-Origin-Embedder-Policy': 'require-corp' };

export default defineConfig({
  base: './',
  build: { outDir: '../../build/web/page', emptyOutDir: true, target: 'es2022', assetsInlineLimit: 0, modulePreload: { polyfill: false } },
  worker: { format: 'es' },
  server: { headers: isolated },
  preview: { headers: isolated },
  optimizeDeps: { exclude: ['maquette'] },
});
