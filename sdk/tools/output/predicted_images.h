// Writes predicted images to a clip, or to a folder of PNG files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <maquette/maquette.hpp>
#include <optional>
#include <string>

#include "output/canvas.h"

class PredictedImages {
 public:
  // `out`: "" writes nothing. Throws std::runtime_error for a file of another kind.
  PredictedImages(const maquette::Context& context, const std::string& out, const std::string& stem, double fps);

  bool is_clip() const { return clip_.has_value(); }
  // Returns the size of each of `columns` images side by side: `size`, or less if the row would not fit into a frame.
  static PictureSide size_in_row(PictureSide size, size_t columns);
  void add_to_clip(const Canvas& image);
  // Saves the frame, with the mark inside the file, or the images side by side. `sample`: 0-based; -1: none.
  void save(int64_t number, const maquette::Frame& frame, const Canvas* compared, int sample = -1);
  // Returns the name of the clip or folder; "" if nothing was written.
  std::string finish();

 private:
  const maquette::Context& context_;
  const std::filesystem::path out_;
  const std::string stem_;
  std::optional<maquette::Clip> clip_;
  int64_t count_ = 0;
};
