#include "scene/stereo/stereo_photo.h"

namespace maq {

PixelTransfer::PixelTransfer(const PinholeCamera& from, const PinholeCamera& to) {
  // rows of [K' R' R^T K^-1] and K' R' (c - c').
  double rotation[9], offset[3];
  for (int i = 0; i < 3; ++i) {
    offset[i] = 0;
    for (int k = 0; k < 3; ++k) offset[i] += to.rotation[3 * i + k] * (from.centre[k] - to.centre[k]);
    for (int j = 0; j < 3; ++j) {
      rotation[3 * i + j] = 0;
      for (int k = 0; k < 3; ++k) rotation[3 * i + j] += to.rotation[3 * i + k] * from.rotation[3 * j + k];
    }
  }
  const double focal[3] = {to.fx_px, to.fy_px, 1}, middle[3] = {to.cx_px, to.cy_px, 0};
  for (int i = 0; i < 3; ++i) {
    double row[3];
    for (int j = 0; j < 3; ++j) row[j] = focal[i] * rotation[3 * i + j] + middle[i] * rotation[6 + j];
    shift[i] = focal[i] * offset[i] + middle[i] * offset[2];
    turn[3 * i] = row[0] / from.fx_px;
    turn[3 * i + 1] = row[1] / from.fy_px;
    turn[3 * i + 2] = row[2] - turn[3 * i] * from.cx_px - turn[3 * i + 1] * from.cy_px;
  }
}

}  // namespace maq
