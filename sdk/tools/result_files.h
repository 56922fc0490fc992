// The files of a dense pose result (docs/formats.md).
#pragma once

#include <filesystem>
#include <maquette/maquette.hpp>
#include <opencv2/core.hpp>
#include <string>

// A plane of the result as an 8-bit image of the result's memory.
cv::Mat plane_of(const maquette::DensePoseResult& result, maq_densepose_plane plane);

// Writes <stem>_IUV.png, <stem>_INDS.png and <stem>.json. All three are encoded before the first is written.
void write_result_files(const maquette::DensePoseResult& result, const std::filesystem::path& folder,
                        const std::string& stem);

// Encodes by the extension of `path` and writes the file.
void write_image(const std::filesystem::path& path, const cv::Mat& image);
