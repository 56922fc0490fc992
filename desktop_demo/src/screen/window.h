// A window with an OpenGL 3.3 core context and Dear ImGui in it, and its input.
#pragma once

#include <app/rgba_image.h>
#include <array>
#include <string>
#include <vector>

struct GLFWwindow;

double monotonic_s();  // since some time in the past

// In units of the window, from its top left corner.
struct Rect {
  int x = 0, y = 0, width = 0, height = 0;
  // The largest of the shape width : height that fits, in the middle.
  Rect fit(int of_width, int of_height) const;
  std::array<int, 4> numbers() const { return {x, y, width, height}; }
};

class Window {
 public:
  // Throws std::runtime_error, a sentence with advice, where no window or no OpenGL 3.3 can be had.
  Window(const char* title, int width, int height, bool visible);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  bool is_closing() const;
  void close();
  void hide();
  // Returns when there is input, after wake(), or after `max_s`.
  void wait(double max_s);
  // From any thread: ends a wait.
  static void wake();
  void begin_drawing();
  void end_drawing();
  void show();  // shows the drawn frame
  maquette::RgbaImage read_pixels(const Rect& rect) const;
  void toggle_full_screen();

  // Layout is in the units of the window system, which may be several pixels each.
  Rect rect() const;
  Rect in_pixels(const Rect& rect) const;
  float scale() const { return scale_; }  // of texts and margins
  std::string opengl() const;
  // Keys (GLFW_KEY_…) that were pressed since the last call; Ctrl+Q closes.
  std::vector<int> take_keys();
  // 1 while `key` is held down, -1 while `other` is, 0 for both or none.
  float held(int key, int other = 0) const;
  // Paths that were dropped since the last call.
  std::vector<std::string> take_drops();

 private:
  void set_scale(float content_scale);

  GLFWwindow* window_ = nullptr;
  float scale_ = 0, font_scale_ = 1;
  int placed_[4] = {};  // before it filled the screen: x, y, width, height
  std::vector<int> keys_;
  std::vector<std::string> drops_;
};
