// Writes predicted images to a clip, or to a folder of PNG files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <maquette/maquette.hpp>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

class PredictedImages {
 public:
  // `out`: "" writes nothing. Throws std::runtime_error for a file of another kind.
  PredictedImages(const maquette::Context& context, const std::string& out, const std::string& stem, double fps);

  bool is_clip() const { return clip_.has_value(); }
  // Returns the size of each of `columns` images side by side: `size`, or less if the row would not fit into the clip
  // or into a frame.
  cv::Size size_in_row(cv::Size size, size_t columns) const;
  void add_to_clip(const cv::Mat& image);  // scaled down if it does not fit
  // Saves the frame, with the mark inside the file, or the images side by side. `sample`: 0-based; -1: none.
  void save(int64_t number, const maquette::Frame& frame, const cv::Mat* compared, int sample = -1);
  // Returns the name of the clip or folder; "" if nothing was written.
  std::string finish();

 private:
  const maquette::Context& context_;
  const std::filesystem::path out_;
  const std::string stem_;
  std::optional<maquette::Clip> clip_;
  int64_t count_ = 0;
};
