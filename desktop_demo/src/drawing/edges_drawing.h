// Draws over the image of edges: curves, corners, boxes with their lengths, a legend, and the target at the pointer.
#pragma once

#include <app/edges_frame.h>
#include <imgui.h>
#include <string>

#include "screen/window.h"

class EdgesDrawing {
 public:
  // Onto `rect`, which shows the frame's image. `scale`: of texts and lines. The frame must outlive this.
  EdgesDrawing(const maquette::EdgesFrame& frame, const Rect& rect, float scale);
  ~EdgesDrawing();
  EdgesDrawing(const EdgesDrawing&) = delete;
  EdgesDrawing& operator=(const EdgesDrawing&) = delete;

  void curves(int highlighted) const;  // and corners; -1: none is highlighted
  void outlines() const;               // of boxes, to be drawn under curves
  void lengths() const;                // of their sides
  void legend() const;
  void pointer(const maquette::EdgesPick& pick, const maquette::Pixel& at) const;

  // Where a place of the window is in the frame.
  maquette::Pixel frame_pixel(const ImVec2& at) const;
  float units_per_px() const { return px_; }

 private:
  ImVec2 on_screen(const maquette::Pixel& pixel) const;
  ImVec2 on_screen(const double* point_m) const { return on_screen(maquette::pixel_of(camera_, point_m)); }
  void polyline(const double* points_m, size_t count, ImU32 colour, float width) const;
  void label(const ImVec2& middle, const std::string& text, ImU32 colour) const;

  const maquette::EdgesFrame& frame_;
  const maq_intrinsics& camera_;
  const Rect rect_;
  const float scale_, px_;  // px_: units of the window for each pixel of the frame
  ImDrawList* const list_;
};

std::string text_of(const maq_edges_box& box);  // "444 ± 3 x 432 ± 2 x 410 ± 5 mm"
