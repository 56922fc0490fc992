/* A camera with its pose, for scenes, heads and edges of several views. */
#ifndef MAQUETTE_PINHOLE_CAMERA_H_
#define MAQUETTE_PINHOLE_CAMERA_H_

#include "maquette/source.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A camera and its pose, in the convention of OpenCV: x to the right, y down, z forward. A point X of the world has the
 * camera coordinates rotation * (X - centre). Lengths are in metres for heads and edges. For scenes they are in the
 * unit of the point cloud ("units of the scene"). */
typedef struct maq_pinhole_camera {
  uint32_t struct_size;
  maq_intrinsics intrinsics; /* of the photo, or of the image to render. Photos for scenes may have distortion.
                                To render, all distortion must be 0. */
  double rotation[9];        /* world to camera, row-major; right-handed and orthonormal (to 0.001) */
  double centre[3];          /* position of the camera in the world */
} maq_pinhole_camera;

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_PINHOLE_CAMERA_H_ */
