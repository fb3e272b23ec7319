// A client made of the OpenIGTLink library, as 3D Slicer is.
#pragma once

#include <igtlClientSocket.h>
#include <igtlImageMessage.h>
#include <igtlMessageHeader.h>
#include <igtlStatusMessage.h>
#include <igtlStringMessage.h>
#include <igtlTimeStamp.h>
#include <igtlTransformMessage.h>

#include <Eigen/Core>

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace stylet::tests {

/// A message as the library unpacked it.
struct ClientMessage {
  std::string type;  ///< empty: the server has closed, or nothing came within the timeout
  std::string device;
  double utc_s = 0;
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();  ///< of TRANSFORM; of IMAGE as its header says
  // IMAGE
  Eigen::Vector3i size = Eigen::Vector3i::Zero();
  Eigen::Vector3d spacing = Eigen::Vector3d::Zero();
  std::vector<std::uint8_t> pixels{};
  // STATUS, STRING
  int code = 0;
  std::string text{};
  std::string body{};  ///< of what has a header of version 2, which Debian's library does not know

  /// From pixels to RAS mm, computed as 3D Slicer does for an IMAGE.
  Eigen::Matrix4d ras_from_pixel() const {
    Eigen::Matrix4d ras = matrix;
    for (int axis = 0; axis < 3; ++axis) {
      ras.col(axis) = matrix.col(axis).normalized() * spacing[axis];
      ras.col(3) -= 0.5 * (size[axis] - 1) * ras.col(axis);
    }
    return ras;
  }
};

class IgtlClient {
public:
  bool connect(int port, const char* host = "127.0.0.1") {
    socket_ = igtl::ClientSocket::New();
    if (socket_->ConnectToServer(host, port) != 0) return false;
    socket_->SetReceiveTimeout(kTimeoutMs);
    return true;
  }
  void close() { socket_->CloseSocket(); }

  ClientMessage receive() {
    auto header = igtl::MessageHeader::New();
    header->InitPack();
    if (!receive_fully(header->GetPackPointer(), header->GetPackSize())) return {};
    const std::string bytes(static_cast<const char*>(header->GetPackPointer()), header->GetPackSize());
    if (bytes[1] == 2) return receive_version_2(bytes);
    if ((header->Unpack() & igtl::MessageHeader::UNPACK_HEADER) == 0) return {};
    ClientMessage message;
    auto stamp = igtl::TimeStamp::New();
    header->GetTimeStamp(stamp);
    message.utc_s = stamp->GetTimeStamp();
    message.device = header->GetDeviceName();
    const std::string type = header->GetDeviceType();
    if (type == "IMAGE") {
      unpack<igtl::ImageMessage>(header, message, read_image);
    } else if (type == "TRANSFORM") {
      unpack<igtl::TransformMessage>(header, message, [](igtl::TransformMessage& m, ClientMessage& out) {
        igtl::Matrix4x4 matrix;
        m.GetMatrix(matrix);
        copy(matrix, out.matrix);
      });
    } else if (type == "STATUS") {
      unpack<igtl::StatusMessage>(header, message, [](igtl::StatusMessage& m, ClientMessage& out) {
        out.code = m.GetCode();
        out.text = m.GetStatusString();
      });
    } else if (type == "STRING") {
      unpack<igtl::StringMessage>(header, message,
                                  [](igtl::StringMessage& m, ClientMessage& out) { out.text = m.GetString(); });
    }
    if (unpacked_) message.type = type;
    return message;
  }

  /// The next message of that device, whatever others come before it; its type is empty if the server closes or says
  /// nothing of that device for long.
  ClientMessage receive(const std::string& device) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::minutes(1);
    while (std::chrono::steady_clock::now() < deadline) {
      ClientMessage message = receive();
      if (message.type.empty() || message.device == device) return message;
    }
    return {};
  }

  bool send(igtl::MessageBase& message) {
    message.Pack();
    return socket_->Send(message.GetPackPointer(), message.GetPackSize()) != 0;
  }
  bool send(const std::vector<std::uint8_t>& bytes) {
    return socket_->Send(bytes.data(), static_cast<int>(bytes.size())) != 0;
  }
  bool send_transform(const char* device, const Eigen::Matrix4d& matrix) {
    auto message = igtl::TransformMessage::New();
    message->SetDeviceName(device);
    igtl::Matrix4x4 m;
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) m[i][j] = static_cast<float>(matrix(i, j));
    }
    message->SetMatrix(m);
    return send(*message);
  }
  /// Reads on until the server closes.
  bool is_closed() {
    std::vector<char> rest(65536);
    for (int n = 0; n < 10'000; ++n) {
      const int got = socket_->Receive(rest.data(), static_cast<int>(rest.size()), 0);
      if (got <= 0) return got == 0;
    }
    return false;
  }

  static constexpr int kTimeoutMs = 10'000;

private:
  static void copy(const igtl::Matrix4x4& from, Eigen::Matrix4d& to) {
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) to(i, j) = double(from[i][j]);
    }
  }

  static void read_image(igtl::ImageMessage& m, ClientMessage& out) {
    igtl::Matrix4x4 matrix;
    m.GetMatrix(matrix);
    copy(matrix, out.matrix);
    int size[3];
    float spacing[3];
    m.GetDimensions(size);
    m.GetSpacing(spacing);
    out.size = {size[0], size[1], size[2]};
    out.spacing = {double(spacing[0]), double(spacing[1]), double(spacing[2])};
    const auto* pixels = static_cast<const std::uint8_t*>(m.GetScalarPointer());
    if (m.GetScalarType() == igtl::ImageMessage::TYPE_UINT8 && m.GetNumComponents() == 1 &&
        m.GetCoordinateSystem() == igtl::ImageMessage::COORDINATE_RAS) {
      out.pixels.assign(pixels, pixels + m.GetImageSize());
    }
  }

  ClientMessage receive_version_2(const std::string& header) {
    std::size_t size = 0;
    for (int i = 42; i < 50; ++i) size = size << 8 | static_cast<std::uint8_t>(header[i]);
    ClientMessage message;
    message.device = header.substr(14, 20).c_str();
    message.body = std::string(size, ' ');
    if (receive_fully(message.body.data(), static_cast<int>(size))) message.type = header.substr(2, 12).c_str();
    return message;
  }

  bool receive_fully(void* room, int size) {
    // With a timeout the library's own "read fully" returns what there is.
    auto* bytes = static_cast<char*>(room);
    for (int got = 0; got < size;) {
      const int n = socket_->Receive(bytes + got, size - got, 0);
      if (n <= 0) return false;
      got += n;
    }
    return true;
  }

  template <typename Message, typename Read>
  void unpack(const igtl::MessageHeader::Pointer& header, ClientMessage& out, const Read& read) {
    auto message = Message::New();
    message->SetMessageHeader(header);
    message->AllocatePack();
    unpacked_ = receive_fully(message->GetPackBodyPointer(), message->GetPackBodySize()) &&
                (message->Unpack(1) & igtl::MessageHeader::UNPACK_BODY) != 0;
    if (unpacked_) read(*message, out);
  }

  igtl::ClientSocket::Pointer socket_;
  bool unpacked_ = false;
};

}  // namespace stylet::tests
