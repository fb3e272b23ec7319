#include "engine/view/window.h"

#define GLFW_INCLUDE_VULKAN
#include <GLFW/glfw3.h>

#include <algorithm>
#include <thread>
#include <utility>

namespace stylet::view {

namespace {

constexpr std::size_t kFramesInFlight = 2;

std::string glfw_error() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text != nullptr ? text : "no reason given";
}

gpu::SemaphoreHandle make_semaphore(gpu::Device& device) {
  const VkSemaphoreCreateInfo create{VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO};
  VkSemaphore semaphore = VK_NULL_HANDLE;
  gpu::check(vkCreateSemaphore(device.handle(), &create, nullptr, &semaphore), "vkCreateSemaphore");
  return {device.handle(), semaphore};
}

Key key_of(int code) {
  if (code >= GLFW_KEY_0 && code <= GLFW_KEY_9) return Key::digit_0 + (code - GLFW_KEY_0);
  if (code >= GLFW_KEY_A && code <= GLFW_KEY_Z) return Key::a + (code - GLFW_KEY_A);
  if (code >= GLFW_KEY_F1 && code <= GLFW_KEY_F12) return Key::f1 + (code - GLFW_KEY_F1);
  switch (code) {
    case GLFW_KEY_RIGHT:
      return Key::right;
    case GLFW_KEY_LEFT:
      return Key::left;
    case GLFW_KEY_DOWN:
      return Key::down;
    case GLFW_KEY_UP:
      return Key::up;
    case GLFW_KEY_PAGE_UP:
      return Key::page_up;
    case GLFW_KEY_PAGE_DOWN:
      return Key::page_down;
    case GLFW_KEY_HOME:
      return Key::home;
    case GLFW_KEY_END:
      return Key::end;
    case GLFW_KEY_SPACE:
      return Key::space;
    case GLFW_KEY_ENTER:
      return Key::enter;
    case GLFW_KEY_TAB:
      return Key::tab;
    case GLFW_KEY_BACKSPACE:
      return Key::backspace;
    case GLFW_KEY_MINUS:
      return Key::minus;
    case GLFW_KEY_EQUAL:
      return Key::equal;
    case GLFW_KEY_KP_SUBTRACT:
      return Key::pad_minus;
    case GLFW_KEY_KP_ADD:
      return Key::pad_plus;
    default:
      return Key::none;
  }
}

/// In the units of the window system; 0: unknown.
struct Size {
  int width = 0;
  int height = 0;
};

/// Of the screen on which a window opens, without bars that belong to the desktop.
Size work_area() {
  Size area;
  GLFWmonitor* monitor = glfwGetPrimaryMonitor();
  if (monitor == nullptr) return area;
  int x = 0, y = 0;
  glfwGetMonitorWorkarea(monitor, &x, &y, &area.width, &area.height);
  return area;
}

Size within(const Size& wanted, const Size& room) {
  return {room.width > 0 ? std::min(wanted.width, room.width) : wanted.width,
          room.height > 0 ? std::min(wanted.height, room.height) : wanted.height};
}

VkSemaphoreSubmitInfo at_stage(VkSemaphore semaphore, VkPipelineStageFlags2 stage) {
  VkSemaphoreSubmitInfo info{VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO};
  info.semaphore = semaphore;
  info.stageMask = stage;
  return info;
}

}  // namespace

Display::Display() {
  if (glfwInit() != GLFW_TRUE)
    throw gpu::GpuError("no display: " + glfw_error() + "; run with --view headless, or under xvfb-run");
  if (glfwVulkanSupported() != GLFW_TRUE) {
    glfwTerminate();
    throw gpu::GpuError("this display has no Vulkan; run with --view headless");
  }
}

Display::~Display() {
  glfwTerminate();
}

std::string Display::library_version() {
  return glfwGetVersionString();
}

std::vector<std::string> Display::vulkan_extensions() const {
  std::uint32_t count = 0;
  const char** names = glfwGetRequiredInstanceExtensions(&count);
  return {names, names + count};
}

struct Window::Surface {
  VkInstance instance;
  VkSurfaceKHR handle = VK_NULL_HANDLE;
  ~Surface() { vkDestroySurfaceKHR(instance, handle, nullptr); }
};

Window::Window(Display&, gpu::Device& device, const WindowSettings& settings)
    : device_(device), settings_(settings), window_(nullptr, glfwDestroyWindow) {
  if (!device.can_present())
    throw gpu::GpuError("the device was made without a window's extensions; pass Display::vulkan_extensions()");
  glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
  // A size that was there before is in pixels already.
  glfwWindowHint(GLFW_SCALE_TO_MONITOR, settings.placement ? GLFW_FALSE : GLFW_TRUE);
  glfwWindowHint(GLFW_MAXIMIZED, settings.placement && settings.placement->maximised ? GLFW_TRUE : GLFW_FALSE);
  if (settings.placement) {
    settings_.width = settings.placement->width;
    settings_.height = settings.placement->height;
  }
  window_.reset(glfwCreateWindow(settings_.width, settings_.height, settings.title.c_str(), nullptr, nullptr));
  if (!window_) throw gpu::GpuError("cannot open a window: " + glfw_error() + "; run with --view headless");
  const Size room = settings.placement ? Size{} : work_area();
  if (settings.least_width > 0) {
    const Size least = within({settings.least_width, settings.least_height}, room);
    glfwSetWindowSizeLimits(window_.get(), least.width, least.height, GLFW_DONT_CARE, GLFW_DONT_CARE);
  }
  // Not every window manager sees to it, and there may be none.
  Size made;
  glfwGetWindowSize(window_.get(), &made.width, &made.height);
  const Size fits = within(made, room);
  if (fits.width < made.width || fits.height < made.height) glfwSetWindowSize(window_.get(), fits.width, fits.height);
  if (settings.placement && !settings.placement->maximised) {
    glfwSetWindowPos(window_.get(), settings.placement->x, settings.placement->y);
  }
  surface_ = std::make_unique<Surface>(Surface{device.instance()});
  gpu::check(glfwCreateWindowSurface(device.instance(), window_.get(), nullptr, &surface_->handle),
             "glfwCreateWindowSurface");
  VkBool32 supported = VK_FALSE;
  vkGetPhysicalDeviceSurfaceSupportKHR(device.physical(), device.queue_family(), surface_->handle, &supported);
  if (supported == VK_FALSE)
    throw gpu::GpuError(device.identity().name + " cannot draw to this display; choose another GPU (--gpu)");

  for (std::size_t i = 0; i < kFramesInFlight; ++i) {
    commands_.emplace_back(device);
    acquired_.push_back(make_semaphore(device));
  }
  glfwSetWindowUserPointer(window_.get(), this);
  glfwGetCursorPos(window_.get(), &cursor_x_, &cursor_y_);
  glfwSetFramebufferSizeCallback(window_.get(), [](GLFWwindow* window, int, int) {
    static_cast<Window*>(glfwGetWindowUserPointer(window))->stale_ = true;
  });
  glfwSetKeyCallback(window_.get(), [](GLFWwindow* window, int key, int, int action, int modifiers) {
    const Key pressed = key_of(key);
    if (action == GLFW_RELEASE || pressed == Key::none) return;
    Input& input = static_cast<Window*>(glfwGetWindowUserPointer(window))->pending_;
    input.strokes.push_back(
        {pressed, (modifiers & GLFW_MOD_SHIFT) != 0, action == GLFW_REPEAT, (modifiers & GLFW_MOD_CONTROL) != 0});
  });
  glfwSetScrollCallback(window_.get(), [](GLFWwindow* window, double, double notches) {
    Input& input = static_cast<Window*>(glfwGetWindowUserPointer(window))->pending_;
    const bool control = glfwGetKey(window, GLFW_KEY_LEFT_CONTROL) == GLFW_PRESS ||
                         glfwGetKey(window, GLFW_KEY_RIGHT_CONTROL) == GLFW_PRESS;
    (control ? input.zoom : input.advance) += notches;
    input.wheel += notches;
  });
  glfwSetMouseButtonCallback(window_.get(), [](GLFWwindow* window, int button, int action, int) {
    Window& self = *static_cast<Window*>(glfwGetWindowUserPointer(window));
    Input& input = self.pending_;
    const Eigen::Vector2d at = self.pointer();
    if (button == GLFW_MOUSE_BUTTON_LEFT) input.presses.push_back({action == GLFW_PRESS, at.x(), at.y()});
    if (button == GLFW_MOUSE_BUTTON_LEFT && action == GLFW_PRESS) input.left = true;
    if (button == GLFW_MOUSE_BUTTON_RIGHT && action == GLFW_PRESS) input.right = true;
  });
  glfwSetCursorPosCallback(window_.get(), [](GLFWwindow* window, double x, double y) {
    Window& self = *static_cast<Window*>(glfwGetWindowUserPointer(window));
    int width = 0, height = 1;
    glfwGetWindowSize(window, &width, &height);
    const double dx = (x - self.cursor_x_) / std::max(height, 1), dy = (y - self.cursor_y_) / std::max(height, 1);
    self.cursor_x_ = x;
    self.cursor_y_ = y;
    if (glfwGetMouseButton(window, GLFW_MOUSE_BUTTON_LEFT) == GLFW_PRESS) {
      self.pending_.drag_x += dx;
      self.pending_.drag_y += dy;
    } else if (glfwGetMouseButton(window, GLFW_MOUSE_BUTTON_RIGHT) == GLFW_PRESS) {
      self.pending_.orbit_x += dx;
      self.pending_.orbit_y += dy;
    } else if (glfwGetMouseButton(window, GLFW_MOUSE_BUTTON_MIDDLE) == GLFW_PRESS) {
      const bool shift = glfwGetKey(window, GLFW_KEY_LEFT_SHIFT) == GLFW_PRESS ||
                         glfwGetKey(window, GLFW_KEY_RIGHT_SHIFT) == GLFW_PRESS;
      (shift ? self.pending_.turn_x : self.pending_.slide_x) += dx;
      (shift ? self.pending_.turn_y : self.pending_.slide_y) += dy;
    }
  });
  create_swapchain();
}

Window::~Window() {
  device_.settle();  // the presentation engine may still read the images
}

void Window::create_swapchain() {
  device_.settle();
  VkSurfaceCapabilitiesKHR limits;
  gpu::check(vkGetPhysicalDeviceSurfaceCapabilitiesKHR(device_.physical(), surface_->handle, &limits),
             "vkGetPhysicalDeviceSurfaceCapabilitiesKHR");
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_.get(), &width, &height);
  extent_ = limits.currentExtent.width != 0xffffffffu
                ? limits.currentExtent
                : VkExtent2D{std::clamp(static_cast<std::uint32_t>(width), limits.minImageExtent.width,
                                        limits.maxImageExtent.width),
                             std::clamp(static_cast<std::uint32_t>(height), limits.minImageExtent.height,
                                        limits.maxImageExtent.height)};
  stale_ = false;
  if (extent_.width == 0 || extent_.height == 0) return;  // minimised: keep what is there, draw nothing

  // An sRGB format, chosen by name and not by place in the list: blits then convert to what the screen expects.
  std::uint32_t count = 0;
  vkGetPhysicalDeviceSurfaceFormatsKHR(device_.physical(), surface_->handle, &count, nullptr);
  std::vector<VkSurfaceFormatKHR> formats(count);
  vkGetPhysicalDeviceSurfaceFormatsKHR(device_.physical(), surface_->handle, &count, formats.data());
  const auto format = std::find_if(formats.begin(), formats.end(), [](const VkSurfaceFormatKHR& f) {
    return (f.format == VK_FORMAT_B8G8R8A8_SRGB || f.format == VK_FORMAT_R8G8B8A8_SRGB) &&
           f.colorSpace == VK_COLOR_SPACE_SRGB_NONLINEAR_KHR;
  });
  if (format == formats.end() || (limits.supportedUsageFlags & VK_IMAGE_USAGE_TRANSFER_DST_BIT) == 0)
    throw gpu::GpuError(device_.identity().name +
                        " offers no 8-bit sRGB images on this display; run with --view headless");
  format_ = format->format;

  VkSwapchainCreateInfoKHR create{VK_STRUCTURE_TYPE_SWAPCHAIN_CREATE_INFO_KHR};
  create.surface = surface_->handle;
  create.minImageCount = limits.maxImageCount == 0 ? std::max(3u, limits.minImageCount)
                                                   : std::clamp(3u, limits.minImageCount, limits.maxImageCount);
  create.imageFormat = format_;
  create.imageColorSpace = format->colorSpace;
  create.imageExtent = extent_;
  create.imageArrayLayers = 1;
  create.imageUsage = VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT |
                      (limits.supportedUsageFlags & VK_IMAGE_USAGE_TRANSFER_SRC_BIT);
  create.preTransform = limits.currentTransform;
  create.compositeAlpha = VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR;
  create.presentMode = VK_PRESENT_MODE_FIFO_KHR;  // the one mode that always exists
  create.clipped = VK_TRUE;
  create.oldSwapchain = swapchain_.get();
  VkSwapchainKHR swapchain = VK_NULL_HANDLE;
  gpu::check(vkCreateSwapchainKHR(device_.handle(), &create, nullptr, &swapchain), "vkCreateSwapchainKHR");
  swapchain_ = gpu::SwapchainHandle(device_.handle(), swapchain);

  vkGetSwapchainImagesKHR(device_.handle(), swapchain, &count, nullptr);
  std::vector<VkImage> images(count);
  vkGetSwapchainImagesKHR(device_.handle(), swapchain, &count, images.data());
  if (overlay_ != nullptr) overlay_->forget_targets();
  images_.clear();
  drawn_.clear();
  for (VkImage image : images) {
    images_.emplace_back(
        device_, image,
        gpu::ImageSettings{
            .width = extent_.width, .height = extent_.height, .format = format_, .usage = create.imageUsage});
    drawn_.push_back(make_semaphore(device_));
  }
}

Eigen::Vector2d Window::pointer() const {
  int width = 0, height = 0;
  glfwGetWindowSize(window_.get(), &width, &height);
  return {cursor_x_ * extent_.width / std::max(width, 1), cursor_y_ * extent_.height / std::max(height, 1)};
}

Input Window::poll() {
  glfwPollEvents();
  pending_.close = glfwWindowShouldClose(window_.get()) == GLFW_TRUE;
  const Eigen::Vector2d at = pointer();
  pending_.pointer_x = at.x();
  pending_.pointer_y = at.y();
  pending_.left = pending_.left || glfwGetMouseButton(window_.get(), GLFW_MOUSE_BUTTON_LEFT) == GLFW_PRESS;
  pending_.right = pending_.right || glfwGetMouseButton(window_.get(), GLFW_MOUSE_BUTTON_RIGHT) == GLFW_PRESS;
  pending_.shift = glfwGetKey(window_.get(), GLFW_KEY_LEFT_SHIFT) == GLFW_PRESS ||
                   glfwGetKey(window_.get(), GLFW_KEY_RIGHT_SHIFT) == GLFW_PRESS;
  return std::exchange(pending_, Input{});
}

void Window::set_title(const std::string& title) {
  glfwSetWindowTitle(window_.get(), title.c_str());
}

WindowPlacement Window::placement() const {
  WindowPlacement placement;
  glfwGetWindowPos(window_.get(), &placement.x, &placement.y);
  glfwGetWindowSize(window_.get(), &placement.width, &placement.height);
  placement.maximised = glfwGetWindowAttrib(window_.get(), GLFW_MAXIMIZED) == GLFW_TRUE;
  return placement;
}

double Window::content_scale() const {
  float x = 1, y = 1;
  glfwGetWindowContentScale(window_.get(), &x, &y);
  return std::max(x, y);
}

void Window::present(const gpu::Image& scene, const gpu::Image* ultrasound, const picture::Picture* plot) {
  picture::PaneLayout layout = picture::PaneLayout::of(width(), height(), plot != nullptr);
  if (ultrasound == nullptr && plot == nullptr) layout.scene = {0, 0, width(), height()};
  present({.scene = &scene, .ultrasound = ultrasound, .plot = plot, .layout = layout});
}

void Window::present(const gpu::Image& scene, const Placed& ultrasound, Overlay& overlay) {
  overlay_ = &overlay;
  present({.scene = &scene,
           .ultrasound = &ultrasound.picture,
           .overlay = &overlay,
           .layout = {.scene = {0, 0, width(), height()}, .ultrasound = ultrasound.place, .plot = {}}});
}

void Window::present(Overlay& overlay) {
  overlay_ = &overlay;
  present({.overlay = &overlay});
}

void Window::forget_overlay() {
  device_.settle();
  overlay_ = nullptr;
}

void Window::idle() {
  pace();
  create_swapchain();
}

void Window::present(const FrameParts& frame) {
  pace();
  if (stale_ || extent_.width == 0 || extent_.height == 0) create_swapchain();
  if (extent_.width == 0 || extent_.height == 0) return;
  const std::size_t slot = frames_ % kFramesInFlight;
  gpu::Commands& commands = commands_[slot];
  commands.begin();  // waits until this slot's semaphore is free again
  std::uint32_t index = 0;
  const VkResult acquired = vkAcquireNextImageKHR(device_.handle(), swapchain_.get(), 1'000'000'000,
                                                  acquired_[slot].get(), VK_NULL_HANDLE, &index);
  if (acquired == VK_ERROR_OUT_OF_DATE_KHR || acquired == VK_TIMEOUT) {
    stale_ = true;  // the next frame gets a new swapchain; this one is dropped
    commands.submit();
    return;
  }
  if (acquired != VK_SUBOPTIMAL_KHR) gpu::check(acquired, "vkAcquireNextImageKHR");
  record(commands, index, frame);
  commands.submit({at_stage(acquired_[slot].get(), VK_PIPELINE_STAGE_2_TRANSFER_BIT)},
                  {at_stage(drawn_[index].get(), VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT)});
  const VkSemaphore ready = drawn_[index].get();
  const VkSwapchainKHR swapchain = swapchain_.get();
  VkPresentInfoKHR info{VK_STRUCTURE_TYPE_PRESENT_INFO_KHR};
  info.waitSemaphoreCount = 1;
  info.pWaitSemaphores = &ready;
  info.swapchainCount = 1;
  info.pSwapchains = &swapchain;
  info.pImageIndices = &index;
  const VkResult presented = vkQueuePresentKHR(device_.queue(), &info);
  if (presented == VK_ERROR_OUT_OF_DATE_KHR || presented == VK_SUBOPTIMAL_KHR)
    stale_ = true;
  else
    gpu::check(presented, "vkQueuePresentKHR");
  ++frames_;
}

void Window::record(gpu::Commands& commands, std::uint32_t index, const FrameParts& frame) {
  const gpu::Image& target = images_[index];
  // Acquisition is waited for at the transfer stage: the first barrier must wait there too. The contents are
  // discarded.
  target.tracker().assume({VK_PIPELINE_STAGE_2_TRANSFER_BIT, VK_ACCESS_2_NONE, VK_IMAGE_LAYOUT_UNDEFINED});
  composition_.record(commands, target, frame);
  if (settings_.capture && (target.settings().usage & VK_IMAGE_USAGE_TRANSFER_SRC_BIT) != 0) {
    if (!captured_ || captured_->size() != target.layer_bytes()) {
      device_.wait_idle();
      captured_.emplace(device_, target.layer_bytes(), 0, gpu::Memory::readback);
    }
    captured_size_ = extent_;
    commands.copy(target, *captured_);
    commands.transition(*captured_, gpu::kHostRead);
  }
  commands.transition(target, gpu::kPresent);
}

void Window::pace() {
  if (settings_.frames_per_second <= 0) return;
  const auto period = std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(1 / settings_.frames_per_second));
  const auto now = std::chrono::steady_clock::now();
  // Late: start counting anew, a missed frame is not chased.
  if (next_frame_ + period < now) next_frame_ = now;
  std::this_thread::sleep_until(next_frame_);
  next_frame_ += period;
}

void Window::resize(int width, int height) {
  glfwSetWindowSize(window_.get(), width, height);
}

picture::Picture Window::last_frame() const {
  if (!captured_) return {};
  device_.wait_idle();
  picture::Picture picture(static_cast<int>(captured_size_.width), static_cast<int>(captured_size_.height));
  const auto bytes = captured_->mapped_as<std::uint8_t>();
  std::copy(bytes.begin(), bytes.end(), picture.rgba.begin());
  if (format_ == VK_FORMAT_B8G8R8A8_SRGB)
    for (std::size_t i = 0; i < picture.rgba.size(); i += 4) std::swap(picture.rgba[i], picture.rgba[i + 2]);
  return picture;
}

}  // namespace stylet::view
