// What a client asks of the scanner, as text: PLUS's SetUsParameter, or plain words.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace stylet::link {

/// A knob by name, and what it is to be set to.
struct Setting {
  std::string name;
  std::string value;
  bool operator==(const Setting&) const = default;
};

struct ScannerRequest {
  std::vector<Setting> settings{};
  std::string problem{};  ///< one line that holds nothing of the text; empty: none
};

/// Either `<Command Name="SetUsParameter"><Parameter Name="DepthMm" Value="150"/>...</Command>`, as PLUS takes it, or
/// `scanner gain +2`: a sign turns a knob by so much. A value of PLUS has none of that meaning: it gets "=" before
/// it.
ScannerRequest read_scanner_request(std::string_view text);

inline constexpr std::size_t kMostSettings = 32;  ///< in a request
inline constexpr std::size_t kLongestWord = 64;   ///< of a name or a value

}  // namespace stylet::link
