// Where predicted pictures go: a clip, or a folder of PNG files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <maquette/maquette.hpp>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

class PredictedPictures {
 public:
  // `out`: "" where nothing is asked for. Throws std::runtime_error for a file of another kind.
  PredictedPictures(const maquette::Context& context, const std::string& out, const std::string& stem, double fps);

  bool is_clip() const { return clip_.has_value(); }
  // The size that pictures of `size` get, of which `columns` stand beside one another, where the row must fit into the
  // clip, or else into a frame; `size` where it does.
  cv::Size size_in_row(cv::Size size, size_t columns) const;
  void add_to_clip(const cv::Mat& picture);  // made smaller where it does not fit
  // The frame itself, with the mark in the file; or the pictures drawn side by side. `sample`: from 0; -1: none.
  void save(int64_t number, const maquette::Frame& frame, const cv::Mat* compared, int sample = -1);
  // "": nothing was asked for.
  std::string finish();

 private:
  const maquette::Context& context_;
  const std::filesystem::path out_;
  const std::string stem_;
  std::optional<maquette::Clip> clip_;
  int64_t count_ = 0;
};
