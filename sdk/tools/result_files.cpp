#include "result_files.h"

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <vector>

#include "output_file.h"

namespace fs = std::filesystem;

namespace {

// Coordinates to a hundredth of a pixel and scores to four digits: what is there, without the noise of float to text.
double rounded(double value, double step) { return std::round(value / step) * step; }

std::string result_json(const maquette::DensePoseResult& result) {
  nlohmann::ordered_json document;
  document["width"] = result.width_px();
  document["height"] = result.height_px();
  document["people"] = nlohmann::json::array();
  for (const maq_person& person : result.people()) {
    nlohmann::ordered_json entry;
    entry["box"] = nlohmann::json::array();
    for (const float edge : person.box_px) entry["box"].push_back(rounded(double(edge), 0.01));
    entry["score"] = rounded(double(person.score), 0.0001);
    document["people"].push_back(entry);
  }
  return document.dump() + "\n";
}

std::vector<uchar> encoded(const std::string& extension, const cv::Mat& image) {
  std::vector<uchar> bytes;
  if (!cv::imencode(extension, image, bytes)) {
    throw std::runtime_error("An image cannot be encoded as " + extension + "; use .png or .jpg.");
  }
  return bytes;
}

}  // namespace

cv::Mat plane_of(const maquette::DensePoseResult& result, maq_densepose_plane plane) {
  size_t stride_bytes = 0;
  const uint8_t* pixels = result.plane(plane, &stride_bytes);
  return cv::Mat(result.height_px(), result.width_px(), CV_8UC1, const_cast<uint8_t*>(pixels), stride_bytes);
}

void write_result_files(const maquette::DensePoseResult& result, const fs::path& folder, const std::string& stem) {
  cv::Mat iuv;
  cv::merge(std::vector<cv::Mat>{plane_of(result, MAQ_PLANE_PART), plane_of(result, MAQ_PLANE_U),
                                 plane_of(result, MAQ_PLANE_V)},
            iuv);
  const std::vector<uchar> iuv_png = encoded(".png", iuv);
  const std::vector<uchar> inds_png = encoded(".png", plane_of(result, MAQ_PLANE_PERSON));
  const std::string json = result_json(result);
  write_whole_file(folder / (stem + "_IUV.png"), iuv_png.data(), iuv_png.size());
  write_whole_file(folder / (stem + "_INDS.png"), inds_png.data(), inds_png.size());
  write_whole_file(folder / (stem + ".json"), json.data(), json.size());
}

void write_image(const fs::path& path, const cv::Mat& image) {
  const std::vector<uchar> bytes = encoded(path.extension().string(), image);
  write_whole_file(path, bytes.data(), bytes.size());
}
