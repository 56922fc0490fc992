// Posed photos and the points between them from a COLMAP model.
#pragma once

#include <vector>

#include "scene/capture/colmap_files.h"
#include "scene/capture/import_report.h"
#include "scene/capture/posed_photo.h"
#include "scene/point_cloud.h"

namespace maq {

// COLMAP counts pixels from their corners: the centre of the first one is at (0.5, 0.5) there. Dropped and counted:
// photos without a camera, photos and cameras whose number was there before, cameras without photos. Faults of numbers
// are left to the caller (posed_photo.h).
std::vector<PosedPhoto> read_colmap_photos(const ColmapFiles& files, ImportReport& report);

// Relative to `origin`. Points that are not finite are dropped and counted. Throws MAQ_ERROR_UNSUPPORTED for more than
// kMaxPoints. Ids of points are ignored: two of the same number are two points.
PointCloud read_colmap_points(const ColmapFiles& files, const std::array<double, 3>& origin, ImportReport& report);

}  // namespace maq
