#include "screen/painter.h"

#include <app/live_densepose.h>
#include <epoxy/gl.h>

#include <stdexcept>

#include "screen/shaders.h"

namespace {

// As the shaders call them, in the order of Painter::Texture.
constexpr const char* kTextureNames[] = {"camera", "iuv",       "outfit", "surface", "seen",
                                         "person", "rendering", "photo",  "drawn"};

// Each texture stays bound to a unit of its own; the first is Dear ImGui's.
constexpr int kFirstUnit = 1;
void activate(int texture) { glActiveTexture(unsigned(GL_TEXTURE0 + kFirstUnit + texture)); }

unsigned compiled(unsigned kind, const char* source) {
  const unsigned shader = glCreateShader(kind);
  const char* const sources[] = {kShaderStart, source};
  glShaderSource(shader, 2, sources, nullptr);
  glCompileShader(shader);
  int fine = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &fine);
  char log[1024] = "";
  if (fine == 0) glGetShaderInfoLog(shader, sizeof log, nullptr, log);
  if (fine == 0) throw std::runtime_error(std::string("This OpenGL refuses a shader of the demo: ") + log);
  return shader;
}

unsigned linked(const char* vertex_source, const char* fragment_source) {
  const unsigned program = glCreateProgram();
  const unsigned shaders[] = {compiled(GL_VERTEX_SHADER, vertex_source), compiled(GL_FRAGMENT_SHADER, fragment_source)};
  for (const unsigned shader : shaders) glAttachShader(program, shader);
  glLinkProgram(program);
  for (const unsigned shader : shaders) glDeleteShader(shader);
  int fine = 0;
  glGetProgramiv(program, GL_LINK_STATUS, &fine);
  if (fine == 0) throw std::runtime_error("This OpenGL cannot link the shaders of the demo; update its driver.");
  glUseProgram(program);
  glUniform3fv(glGetUniformLocation(program, "part_colours"), 25, maquette::part_colours().data());
  int unit = kFirstUnit;
  for (const char* const name : kTextureNames) glUniform1i(glGetUniformLocation(program, name), unit++);
  return program;
}

}  // namespace

Painter::Painter(const Window& window) : window_(window) {
  glGenTextures(kTextureCount, textures_);
  glGenVertexArrays(1, &no_vertices_);
  glGenVertexArrays(1, &body_vertices_);
  glGenBuffers(1, &body_buffer_);
  for (int texture = 0; texture < kTextureCount; ++texture) {
    const bool layered = texture == kSurfaceTexture || texture == kSeenTexture;
    const unsigned kind = layered ? GL_TEXTURE_2D_ARRAY : GL_TEXTURE_2D;
    const int filter = texture == kIuvTexture ? GL_NEAREST : GL_LINEAR;
    const int wrap = texture == kOutfitTexture ? GL_REPEAT : GL_CLAMP_TO_EDGE;
    activate(texture);
    glBindTexture(kind, textures_[texture]);
    glTexParameteri(kind, GL_TEXTURE_MIN_FILTER, filter);
    glTexParameteri(kind, GL_TEXTURE_MAG_FILTER, filter);
    glTexParameteri(kind, GL_TEXTURE_WRAP_S, wrap);
    glTexParameteri(kind, GL_TEXTURE_WRAP_T, wrap);
  }
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  people_program_ = linked(kPictureVertexShader, kPeopleShader);
  scene_program_ = linked(kPictureVertexShader, kSceneShader);
  body_program_ = linked(kBodyVertexShader, kBodyShader);
  set_body(maquette::DensePoseMesh(std::vector<float>(24 * 2 * 2 * 3), 2));
}

Painter::~Painter() {
  glDeleteTextures(kTextureCount, textures_);
  glDeleteVertexArrays(1, &no_vertices_);
  glDeleteVertexArrays(1, &body_vertices_);
  glDeleteBuffers(1, &body_buffer_);
  for (const unsigned program : {people_program_, scene_program_, body_program_}) glDeleteProgram(program);
}

int Painter::uniform(const char* name) const { return glGetUniformLocation(program_, name); }

void Painter::upload(Texture texture, int width_px, int height_px, const uint8_t* rgba) {
  activate(texture);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width_px, height_px, 0, GL_RGBA, GL_UNSIGNED_BYTE, rgba);
}

void Painter::set_frame(const maquette::MappedFrame& frame) {
  constexpr int kSeenCells = maquette::MappedFrame::kSeenCells;
  const int width_px = frame.camera.width_px, height_px = frame.camera.height_px;
  upload(kCameraTexture, width_px, height_px, frame.camera.rgba.data());
  upload(kIuvTexture, width_px, height_px, frame.iuv.data());
  if (frame.texture != nullptr && frame.texture != person_) {
    upload(kPersonTexture, frame.texture->width_px, frame.texture->height_px, frame.texture->rgba.data());
  }
  person_ = frame.texture;
  people_ = int(frame.people.size());
  activate(kSeenTexture);
  glTexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_R8, kSeenCells, kSeenCells, 24, 0, GL_RED, GL_UNSIGNED_BYTE,
               frame.seen.data());
}

void Painter::set_outfit(const maquette::RgbaImage& outfit) {
  upload(kOutfitTexture, outfit.width_px, outfit.height_px, outfit.rgba.data());
  outfit_is_atlas_ = outfit.width_px * 3 == outfit.height_px * 2;
}

void Painter::set_scene(const maquette::RgbaImage& rendering, const maquette::RgbaImage& photo,
                        const maquette::RgbaImage& sample) {
  upload(kRenderingTexture, rendering.width_px, rendering.height_px, rendering.rgba.data());
  if (!photo.empty()) upload(kPhotoTexture, photo.width_px, photo.height_px, photo.rgba.data());
  if (!sample.empty()) upload(kSampleTexture, sample.width_px, sample.height_px, sample.rgba.data());
}

void Painter::set_body(const maquette::DensePoseMesh& body) {
  activate(kSurfaceTexture);
  glTexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_RGB32F, body.nodes, body.nodes, 24, 0, GL_RGB, GL_FLOAT,
               body.filled_points_m.data());
  body_vertex_count_ = int(body.triangles.size());
  glBindVertexArray(body_vertices_);
  glBindBuffer(GL_ARRAY_BUFFER, body_buffer_);
  constexpr int kVertexBytes = sizeof(maquette::DensePoseMesh::Vertex);
  glBufferData(GL_ARRAY_BUFFER, GLsizeiptr(body.triangles.size()) * kVertexBytes, body.triangles.data(),
               GL_STATIC_DRAW);
  for (unsigned k = 0; k < 3; ++k) {
    glEnableVertexAttribArray(k);
    glVertexAttribPointer(k, 3, GL_FLOAT, GL_FALSE, kVertexBytes,
                          reinterpret_cast<const void*>(k * 3 * sizeof(float)));  // NOLINT(performance-no-int-to-ptr)
  }
}

void Painter::use(unsigned program, const Rect& rect) {
  glUseProgram(program_ = program);
  const Rect pixels = window_.in_pixels(rect), all = window_.in_pixels(window_.rect());
  glViewport(pixels.x, all.height - pixels.y - pixels.height, pixels.width, pixels.height);
  glBindVertexArray(no_vertices_);
  glDisable(GL_DEPTH_TEST);
}

void Painter::draw_people(View view, const Rect& rect) {
  use(people_program_, rect);
  glUniform1i(uniform("view"), int(view));
  glUniform1i(uniform("people"), people_);
  glUniform1i(uniform("outfit_is_atlas"), outfit_is_atlas_ ? 1 : 0);
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

void Painter::draw_scene(const Rect& rect, float slider) {
  use(scene_program_, rect);
  glUniform1f(uniform("slider"), slider);
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

void Painter::draw_body(const Rect& rect, float yaw, float pitch) {
  if (body_vertex_count_ == 0) return;
  use(body_program_, rect);
  glEnable(GL_DEPTH_TEST);
  glClear(GL_DEPTH_BUFFER_BIT);
  glBindVertexArray(body_vertices_);
  const maquette::BodyCamera camera(yaw, pitch, rect.width, rect.height);
  glUniformMatrix4fv(uniform("projection"), 1, GL_FALSE, camera.projection.data());
  glUniform3fv(uniform("towards_eye"), 1, camera.towards_eye.data());
  glUniform1i(uniform("in_own_colours"), person_ != nullptr ? 1 : 0);
  glDrawArrays(GL_TRIANGLES, 0, body_vertex_count_);
  glDisable(GL_DEPTH_TEST);
}
