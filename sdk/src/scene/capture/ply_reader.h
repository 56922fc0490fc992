// Point clouds from PLY files (G. Turk, "The PLY Polygon File Format", 1994).
#pragma once

#include <string>

#include "scene/capture/import_report.h"
#include "scene/point_cloud.h"

namespace maq {

// The vertices of a file, ASCII or binary of either byte order, relative to `origin`. They need x, y and z, of any type
// and in any order; colours are red, green, blue or diffuse_red, ...: whole numbers from 0 to the most their type has
// (of 4 bytes: to 255), or floats from 0 to 1, or to 255 when one of the file is over 1. Other properties, lists and
// elements are skipped. Vertices that are not finite are dropped and counted. Throws MAQ_ERROR_NOT_FOUND,
// MAQ_ERROR_UNREADABLE for a file that is damaged or shorter than its counts say, and MAQ_ERROR_UNSUPPORTED for more
// than kMaxPoints.
PointCloud read_ply_file(const std::string& path, const std::array<double, 3>& origin, ImportReport& report);

}  // namespace maq
