// Posed photos from a transforms.json, as instant-ngp, nerfstudio and the synthetic scenes of NeRF have it.
#pragma once

#include <string>
#include <vector>

#include "scene/capture/import_report.h"
#include "scene/capture/posed_photo.h"

namespace maq {

struct TransformsFile {
  std::vector<PosedPhoto> photos;  // names relative to the file's folder
  std::string cloud;               // "ply_file_path", relative too; "" if the file names none
};

// `folder`/`file_name`. For each frame `transform_matrix` is camera to world with axes of OpenGL (x right, y up, z
// backward). Intrinsics are the frame's or the file's: fl_x, fl_y, cx, cy, w, h, k1, k2, k3, p1, p2 (of a fisheye k1 to
// k4), pixels counted from the corner of the first one; or camera_angle_x, camera_angle_y in radians. Defaults: fl_y is
// fl_x, cx and cy are the middle, w and h are the photo's. Names without an extension get .png, .jpg or .jpeg,
// whichever there is. "depth_file_path" is a depth image of the same view, "depth_unit_scale_factor" is the length of a
// stored 1. Photos in "test_filenames" are held out. Dropped and counted: photos whose name leads out of the folder;
// photos that are needed for their size and cannot be read. Throws MAQ_ERROR_NOT_FOUND, MAQ_ERROR_UNREADABLE, and
// MAQ_ERROR_UNSUPPORTED for other camera models.
TransformsFile read_transforms_file(const std::string& folder, const std::string& file_name, ImportReport& report);

}  // namespace maq
