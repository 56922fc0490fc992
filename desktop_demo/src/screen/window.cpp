#include "screen/window.h"

#include <epoxy/gl.h>

#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>
#include <algorithm>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <utility>

namespace {
std::string glfw_problem;
}

double monotonic_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

Rect Rect::fit(int of_width, int of_height) const {
  const double scale = std::min(double(width) / std::max(1, of_width), double(height) / std::max(1, of_height));
  const int w = std::max(1, int(of_width * scale)), h = std::max(1, int(of_height * scale));
  return {x + (width - w) / 2, y + (height - h) / 2, w, h};
}

Window::Window(const char* title, int width, int height, bool visible) {
  glfwSetErrorCallback([](int, const char* text) { glfw_problem = text; });
  if (!glfwInit()) {
    throw std::runtime_error("No window can be opened (" + glfw_problem + "). Start the demo in a desktop session; " +
                             "without a screen, `xvfb-run -a maquette-demo ...` draws in software.");
  }
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);
  glfwWindowHint(GLFW_VISIBLE, visible ? GLFW_TRUE : GLFW_FALSE);
  window_ = glfwCreateWindow(width, height, title, nullptr, nullptr);
  if (window_ == nullptr) {
    glfwTerminate();
    throw std::runtime_error("This machine gives no OpenGL 3.3 (" + glfw_problem + "). Install a graphics driver, or " +
                             "software OpenGL (on Debian: libgl1-mesa-dri); `maquette densepose` does without.");
  }
  glfwSetWindowUserPointer(window_, this);
  glfwMakeContextCurrent(window_);
  glfwSwapInterval(visible ? 1 : 0);
  glfwSetDropCallback(window_, [](GLFWwindow* window, int count, const char** paths) {
    auto* const self = static_cast<Window*>(glfwGetWindowUserPointer(window));
    self->drops_.insert(self->drops_.end(), paths, paths + count);
  });
  glfwSetKeyCallback(window_, [](GLFWwindow* window, int key, int, int action, int modifiers) {
    if (action != GLFW_PRESS) return;
    const bool quits = key == GLFW_KEY_Q && (modifiers & GLFW_MOD_CONTROL) != 0;
    if (quits) glfwSetWindowShouldClose(window, GLFW_TRUE);
    if (!quits) static_cast<Window*>(glfwGetWindowUserPointer(window))->keys_.push_back(key);
  });
  glfwSetWindowContentScaleCallback(window_, [](GLFWwindow* window, float x, float) {
    static_cast<Window*>(glfwGetWindowUserPointer(window))->set_scale(x);
  });
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;
  ImGui::GetIO().ConfigFlags |= ImGuiConfigFlags_NavEnableKeyboard;
  ImGui_ImplGlfw_InitForOpenGL(window_, true);
  ImGui_ImplOpenGL3_Init("#version 330 core");
  float scale = 1;
  glfwGetWindowContentScale(window_, &scale, nullptr);
  set_scale(scale);
}

Window::~Window() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
  glfwDestroyWindow(window_);
  glfwTerminate();
}

// Letters are drawn once, for the scale at the start; on another screen they are stretched.
void Window::set_scale(float content_scale) {
  const float unit_px = float(in_pixels({0, 0, 1000, 1000}).width) / 1000;
  const float scale = std::clamp(content_scale / std::max(unit_px, 0.1f), 0.5f, 4.0f);
  ImGuiIO& io = ImGui::GetIO();
  if (scale_ == 0) {
    const char* const font = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";
    ImFontConfig config;
    config.SizePixels = 13 * scale;
    if (std::filesystem::exists(font)) {
      io.Fonts->AddFontFromFileTTF(font, 14 * scale);
    } else {
      io.Fonts->AddFontDefault(&config);
    }
    font_scale_ = scale;
  }
  scale_ = scale;
  io.FontGlobalScale = scale / font_scale_;
  ImGui::GetStyle() = ImGuiStyle();
  ImGui::StyleColorsDark();
  ImGui::GetStyle().WindowRounding = ImGui::GetStyle().FrameRounding = 4;
  ImGui::GetStyle().ScaleAllSizes(scale);
}

bool Window::is_closing() const { return glfwWindowShouldClose(window_) != 0; }
void Window::hide() { glfwHideWindow(window_); }
void Window::close() { glfwSetWindowShouldClose(window_, GLFW_TRUE); }
void Window::wait(double max_s) { max_s > 0 ? glfwWaitEventsTimeout(max_s) : glfwPollEvents(); }
void Window::wake() { glfwPostEmptyEvent(); }

void Window::begin_drawing() {
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glViewport(0, 0, in_pixels(rect()).width, in_pixels(rect()).height);
  glClearColor(0.07f, 0.07f, 0.08f, 1);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
}

void Window::end_drawing() {
  ImGui::Render();
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

void Window::show() { glfwSwapBuffers(window_); }

maquette::RgbaImage Window::read_pixels(const Rect& rect) const {
  const Rect pixels = in_pixels(rect), all = in_pixels(this->rect());
  maquette::RgbaImage picture;
  picture.resize(pixels.width, pixels.height);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(pixels.x, all.height - pixels.y - pixels.height, pixels.width, pixels.height, GL_RGBA, GL_UNSIGNED_BYTE,
               picture.rgba.data());
  // OpenGL's first row is the lowest.
  const size_t row = size_t(pixels.width) * 4;
  for (size_t top = 0, bottom = size_t(pixels.height); top + 1 < bottom; ++top) {
    --bottom;
    std::swap_ranges(&picture.rgba[top * row], &picture.rgba[top * row] + row, &picture.rgba[bottom * row]);
  }
  return picture;
}

void Window::toggle_full_screen() {
  if (glfwGetWindowMonitor(window_) != nullptr) {
    glfwSetWindowMonitor(window_, nullptr, placed_[0], placed_[1], placed_[2], placed_[3], 0);
    return;
  }
  glfwGetWindowPos(window_, &placed_[0], &placed_[1]);
  glfwGetWindowSize(window_, &placed_[2], &placed_[3]);
  GLFWmonitor* const monitor = glfwGetPrimaryMonitor();
  const GLFWvidmode* const mode = monitor == nullptr ? nullptr : glfwGetVideoMode(monitor);
  if (mode != nullptr) glfwSetWindowMonitor(window_, monitor, 0, 0, mode->width, mode->height, mode->refreshRate);
}

Rect Window::rect() const {
  Rect all;
  glfwGetWindowSize(window_, &all.width, &all.height);
  return all;
}

Rect Window::in_pixels(const Rect& rect) const {
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  const double x = double(width) / std::max(1, this->rect().width),
               y = double(height) / std::max(1, this->rect().height);
  return {int(rect.x * x), int(rect.y * y), int(rect.width * x), int(rect.height * y)};
}

std::string Window::opengl() const {
  return std::string(reinterpret_cast<const char*>(glGetString(GL_VERSION))) + ", " +
         reinterpret_cast<const char*>(glGetString(GL_RENDERER));
}

std::vector<int> Window::take_keys() { return std::exchange(keys_, {}); }
float Window::held(int key, int other) const {
  const auto down = [&](int k) { return k != 0 && glfwGetKey(window_, k) == GLFW_PRESS ? 1.0f : 0.0f; };
  return down(key) - down(other);
}
std::vector<std::string> Window::take_drops() { return std::exchange(drops_, {}); }
