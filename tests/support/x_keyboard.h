// Keys and clicks for the window of this process, as an X server sends them; libX11 is loaded where there is a
// display.
#pragma once

#include <dlfcn.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <string>

namespace stylet::support {

class XKeyboard {
public:
  XKeyboard() {
    library_ = dlopen("libX11.so.6", RTLD_NOW | RTLD_LOCAL);
    if (library_ == nullptr) return;
    display_ = find<void* (*)(const char*)>("XOpenDisplay")(nullptr);
  }
  ~XKeyboard() {
    if (display_ != nullptr) find<int (*)(void*)>("XCloseDisplay")(display_);
  }
  XKeyboard(const XKeyboard&) = delete;
  XKeyboard& operator=(const XKeyboard&) = delete;

  static constexpr unsigned int kShift = 1, kControl = 4;
  /// Presses and releases a key, by its X name: "Return", "q". @return false: there is no window yet
  /// @param held  kShift, kControl, together
  bool press(const std::string& key, unsigned int held = 0) {
    const unsigned long window = our_window();
    if (window == 0) return false;
    const unsigned long symbol = find<unsigned long (*)(const char*)>("XStringToKeysym")(key.c_str());
    const auto code = find<unsigned char (*)(void*, unsigned long)>("XKeysymToKeycode")(display_, symbol);
    for (const int type : {2, 3}) send(window, type, code, 1, 1, held);
    find<int (*)(void*, int)>("XSync")(display_, 0);
    return true;
  }

  /// Moves the pointer there, and presses or releases the left button. Pixels of the window.
  /// @return false: there is no window yet
  bool move(int x, int y) { return point(6, x, y, 0, 0); }
  bool button(int x, int y, bool down) { return point(down ? 4 : 5, x, y, 1, down ? 0 : 1U << 8); }

private:
  /// MotionNotify 6, ButtonPress 4, ButtonRelease 5: laid out as XKeyEvent.
  bool point(int type, int x, int y, unsigned int code, unsigned int state) {
    const unsigned long window = our_window();
    if (window == 0) return false;
    send(window, type, code, x, y, state);
    find<int (*)(void*, int)>("XSync")(display_, 0);
    return true;
  }

  /// XKeyEvent of Xlib.h.
  struct KeyEvent {
    int type;
    unsigned long serial;
    int send_event;
    void* display;
    unsigned long window, root, subwindow, time;
    int x, y, x_root, y_root;
    unsigned int state, keycode;
    int same_screen;
  };

  template <typename Function>
  Function find(const char* name) const {
    return reinterpret_cast<Function>(dlsym(library_, name));
  }

  /// A window says whose it is: others of the tests beside this one have some on the same display.
  bool is_ours(unsigned long window) const {
    constexpr unsigned long kCardinal = 6;
    const unsigned long pid_name =
        find<unsigned long (*)(void*, const char*, int)>("XInternAtom")(display_, "_NET_WM_PID", 0);
    unsigned long type = 0, count = 0, left = 0;
    int format = 0;
    unsigned char* data = nullptr;
    find<int (*)(void*, unsigned long, unsigned long, long, long, int, unsigned long, unsigned long*, int*,
                 unsigned long*, unsigned long*, unsigned char**)>("XGetWindowProperty")(
        display_, window, pid_name, 0, 1, 0, kCardinal, &type, &format, &count, &left, &data);
    long pid = 0;  // Xlib gives 32 bits as a long
    if (data != nullptr && format == 32 && count == 1) std::memcpy(&pid, data, sizeof(pid));
    if (data != nullptr) find<int (*)(void*)>("XFree")(data);
    return pid == getpid();
  }

  /// The child of the root that has the title of a session's window, and is of this process.
  unsigned long our_window() const {
    if (display_ == nullptr) return 0;
    unsigned long root = 0, parent = 0, *children = nullptr;
    unsigned int count = 0;
    const unsigned long top = find<unsigned long (*)(void*)>("XDefaultRootWindow")(display_);
    find<int (*)(void*, unsigned long, unsigned long*, unsigned long*, unsigned long**, unsigned int*)>("XQueryTree")(
        display_, top, &root, &parent, &children, &count);
    unsigned long found = 0;
    for (unsigned int i = 0; i < count; ++i) {
      char* name = nullptr;
      find<int (*)(void*, unsigned long, char**)>("XFetchName")(display_, children[i], &name);
      if (name == nullptr) continue;
      if (std::string(name).starts_with("Stylet") && is_ours(children[i])) found = children[i];
      find<int (*)(void*)>("XFree")(name);
    }
    if (children != nullptr) find<int (*)(void*)>("XFree")(children);
    return found;
  }

  void send(unsigned long window, int type, unsigned int code, int x = 1, int y = 1, unsigned int state = 0) {
    std::array<long, 24> event{};  // XEvent
    const KeyEvent key{.type = type,
                       .serial = 0,
                       .send_event = 1,
                       .display = display_,
                       .window = window,
                       .root = find<unsigned long (*)(void*)>("XDefaultRootWindow")(display_),
                       .subwindow = 0,
                       .time = ++time_ * 100,
                       .x = x,
                       .y = y,
                       .x_root = x,
                       .y_root = y,
                       .state = state,
                       .keycode = code,
                       .same_screen = 1};
    std::memcpy(event.data(), &key, sizeof(key));
    find<int (*)(void*, unsigned long, int, long, void*)>("XSendEvent")(display_, window, 0,
                                                                        type < 4 ? 3 : 4 | 8 | 64, event.data());
  }

  void* library_ = nullptr;
  void* display_ = nullptr;
  unsigned long time_ = 0;
};

}  // namespace stylet::support
