// Draws images of people, of scenes and of the body into the window, from textures that it keeps.
#pragma once

#include <app/mapped_frame.h>
#include <maquette/densepose_mesh.hpp>

#include "options.h"
#include "screen/window.h"

class Painter {
 public:
  explicit Painter(const Window& window);
  ~Painter();

  void set_frame(const maquette::MappedFrame& frame);
  // Worn in the try-on view: an atlas of 4 x 6 charts in the DensePose layout (2 : 3), or any image, which is
  // repeated over the body's front and back.
  void set_outfit(const maquette::RgbaImage& outfit);
  void set_body(const maquette::DensePoseMesh& body);
  void set_scene(const maquette::RgbaImage& rendering, const maquette::RgbaImage& photo,
                 const maquette::RgbaImage& sample = {});

  void draw_people(View view, const Rect& rect);
  // `slider`: the fraction of the width that shows the photo; kSample: the sample.
  static constexpr float kSample = 2;
  void draw_scene(const Rect& rect, float slider);
  // Draws the body from a direction, in radians, in the colours of the person if the frame has them, or with seen parts
  // in colours of parts.
  void draw_body(const Rect& rect, float yaw, float pitch);

 private:
  enum Texture {
    kCameraTexture,
    kIuvTexture,
    kOutfitTexture,
    kSurfaceTexture,
    kSeenTexture,
    kPersonTexture,
    kRenderingTexture,
    kPhotoTexture,
    kSampleTexture,
    kTextureCount
  };
  void upload(Texture texture, int width_px, int height_px, const uint8_t* rgba);
  void use(unsigned program, const Rect& rect);
  int uniform(const char* name) const;  // of the program in use

  const Window& window_;
  unsigned people_program_ = 0, scene_program_ = 0, body_program_ = 0, program_ = 0;
  unsigned textures_[kTextureCount] = {};
  unsigned no_vertices_ = 0, body_vertices_ = 0, body_buffer_ = 0;
  int body_vertex_count_ = 0, people_ = 0;
  bool outfit_is_atlas_ = false;
  std::shared_ptr<const maquette::RgbaImage> person_;  // the texture in kPersonTexture
};
