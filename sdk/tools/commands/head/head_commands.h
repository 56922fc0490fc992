// The commands of `maquette head`.
#pragma once

#include <maquette/maquette.hpp>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

void add_head_export_command(CLI::App& head, int* exit_code);
void add_head_info_command(CLI::App& head, int* exit_code);
void add_head_render_command(CLI::App& head, int* exit_code);

// "prior", "given" or "depth".
const char* name_of_scale(maq_head_scale scale);

// "the average of heads, +- 4 %".
std::string text_of_scale(const maq_head_info& info);

// The mesh to make: the animatable head, or the dense surface by --triangles and --cell.
struct MeshChoice {
  std::string triangles;  // a number or "all"; empty: not given
  double cell_mm = 0;
};
void add_mesh_choice(CLI::App& command, MeshChoice& choice);
maq_head_mesh_config mesh_config(const MeshChoice& choice);

// --bundle with the template head, for a head from a file; its folder, empty for the dense surface.
void add_template_bundle_option(CLI::App& command, std::string& bundle);
std::string bundle_of_mesh(const maq_head_mesh_config& mesh, const std::string& named);

// --out of a mesh.
CLI::Option* add_mesh_file_option(CLI::App& command, std::string& path);

// "head.glb: 5027 vertices, 9432 triangles, …" and a line break.
std::string text_of_mesh(const std::string& path, const maq_head_mesh_data& mesh);

// The view of a head in an image or a clip.
struct HeadView {
  maq_head_shading shading = MAQ_HEAD_SHADING_COLOUR;
  int width_px = 640, height_px = 480;
  double yaw_deg = 0, pitch_deg = 0;  // of the camera: to the person's left, up
  int photo = 0;                      // the photo whose camera is used, from 1; 0: yaw and pitch
  double seconds = 6, fps = 25;       // of a clip, in which the head turns once
  int threads = 0;
  bool with_alpha = true;                          // of a PNG; without it, as in clips, the background is seen
  std::vector<int> background_rgb = {46, 48, 54};  // 0 to 255 each
};

// Returns an empty text if `path` can be the name of an image or a clip, else the reason why not.
std::string check_head_view_name(const std::string& path);

// Writes an image (.png, .jpg), or a clip (.mp4) in which the head turns once; makes its folder. Returns the text
// for the user. Throws maquette::Error, or std::runtime_error after an interrupt: then an existing file stays.
std::string write_head_view(const maquette::Context& context, const maquette::Head& head,
                            const maquette::HeadMesh& mesh, const std::string& path, const HeadView& view);

// Distance of the pupils in metres; 0 if the head has no pupils.
double pupil_distance_m(const maquette::Head& head);
