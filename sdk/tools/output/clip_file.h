// Writes drawn images as a clip.
#pragma once

#include <filesystem>
#include <maquette/maquette.hpp>
#include <optional>

#include "output/canvas.h"

class ClipFile {
 public:
  // `path` ends in .mp4. Its folder is made when it is not there. An `fps` of 0 or less is not known.
  ClipFile(const maquette::Context& context, std::filesystem::path path, double fps);

  // All of the size of the first, and of 2 x 2 pixels at least.
  void add(const Canvas& image);
  // Completes the file and returns its path; "" when nothing was added.
  std::filesystem::path finish();

 private:
  const maquette::Context& context_;
  std::filesystem::path path_;
  double fps_;
  std::optional<maquette::Clip> clip_;
};
