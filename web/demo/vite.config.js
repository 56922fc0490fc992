import { defineConfig } from 'vite';

export default defineConfig({
  base: './',
  build: { outDir: '../../build/web/page', emptyOutDir: true, target: 'es2022', assetsInlineLimit: 0, modulePreload: { polyfill: false } },
  worker: { format: 'es' },
  optimizeDeps: { exclude: ['maquette'] },
});
