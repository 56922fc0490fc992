// The panel at the right, with the common parts of all views, and the help.
#pragma once

#include <app/run_measurements.h>

#include "main_view.h"
#include "screen/window.h"

class Panel {
 public:
  explicit Panel(const Window& window) : window_(window) {}

  Action draw(const Rect& rect, MainView& view, bool has_clip);
  void draw_help(bool* is_open) const;

 private:
  void draw_load();

  const Window& window_;
  maquette::ProcessLoad load_;
};
