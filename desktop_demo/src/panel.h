// The panel at the right, with what every view has, and the help.
#pragma once

#include <functional>

#include "options.h"
#include "window.h"

class Panel {
 public:
  explicit Panel(const Window& window) : window_(window) {}

  // `draw_view` draws the view's own part.
  Action draw(const Rect& rect, const std::function<Action()>& draw_view, bool can_record, bool is_recording,
              bool has_clip);
  void draw_help(bool* is_open) const;

 private:
  void draw_load();

  const Window& window_;
  double measured_at_s_ = 0, cpu_s_ = 0, cpu_percent_ = 0, memory_mb_ = 0;  // of the process
};
