#include "engine/sound/output.h"

#include <AL/al.h>
#include <AL/alc.h>
#include <AL/alext.h>
#include <dlfcn.h>

#include <array>
#include <cstddef>
#include <cstdlib>
#include <utility>

namespace stylet::sound {
namespace {

// What is queued is heard 30 ms later at most; a thread that is not looked after for so long makes a gap.
constexpr std::size_t kBlock = kRate / 100;
constexpr std::size_t kBlocks = 3;

extern "C" void say_nothing(const char*, int, const char*, int, const char*, ...) {}

}  // namespace

struct Output::Device {
  ALCdevice* device = nullptr;
  ALCcontext* context = nullptr;
  ALuint source = 0;
  std::array<ALuint, kBlocks> buffers{};
  std::size_t queued = 0;
  std::array<float, kBlock> block{};
  std::string name{};

  Device() = default;
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  ~Device() {
    if (context != nullptr) {
      alcMakeContextCurrent(context);
      if (source != 0) {
        alSourceStop(source);
        alSourcei(source, AL_BUFFER, 0);
        alDeleteSources(1, &source);
        alDeleteBuffers(kBlocks, buffers.data());
      }
      alcMakeContextCurrent(nullptr);
      alcDestroyContext(context);
    }
    if (device != nullptr) alcCloseDevice(device);
  }

  bool open() {
    device = alcOpenDevice(nullptr);
    if (device == nullptr) return false;
    constexpr std::array<ALCint, 5> kWanted{ALC_FREQUENCY, kRate, ALC_HRTF_SOFT, ALC_FALSE, 0};
    context = alcCreateContext(device, kWanted.data());
    if (context == nullptr || alcMakeContextCurrent(context) != ALC_TRUE) return false;
    if (alIsExtensionPresent("AL_EXT_float32") != AL_TRUE) return false;
    alDistanceModel(AL_NONE);
    alGenSources(1, &source);
    alGenBuffers(kBlocks, buffers.data());
    alSourcei(source, AL_SOURCE_RELATIVE, AL_TRUE);  // where the listener is: from the middle
    const bool names = alcIsExtensionPresent(device, "ALC_ENUMERATE_ALL_EXT") == ALC_TRUE;
    const char* called = alcGetString(device, names ? ALC_ALL_DEVICES_SPECIFIER : ALC_DEVICE_SPECIFIER);
    name = called != nullptr ? called : "unnamed";
    return alGetError() == AL_NO_ERROR;
  }

  void queue(ALuint buffer, Mixer& mixer) {
    mixer.render(block);
    alBufferData(buffer, AL_FORMAT_MONO_FLOAT32, block.data(), sizeof(block), kRate);
    alSourceQueueBuffers(source, 1, &buffer);
  }

  bool feed(Mixer& mixer) {
    ALCint connected = ALC_TRUE;
    if (alcIsExtensionPresent(device, "ALC_EXT_disconnect") == ALC_TRUE) {
      alcGetIntegerv(device, ALC_CONNECTED, 1, &connected);
    }
    if (connected == ALC_FALSE) return false;
    for (; queued < kBlocks; ++queued) queue(buffers[queued], mixer);
    ALint played = 0, state = AL_PLAYING;
    alGetSourcei(source, AL_BUFFERS_PROCESSED, &played);
    for (; played > 0; --played) {
      ALuint buffer = 0;
      alSourceUnqueueBuffers(source, 1, &buffer);
      queue(buffer, mixer);
    }
    alGetSourcei(source, AL_SOURCE_STATE, &state);
    if (state != AL_PLAYING) alSourcePlay(source);  // at first, and when nothing was left in the queue
    return alGetError() == AL_NO_ERROR;
  }
};

Output::Output(std::unique_ptr<Device> device) : device_(std::move(device)) {}
Output::Output(Output&&) noexcept = default;
Output& Output::operator=(Output&&) noexcept = default;
Output::~Output() = default;

std::optional<Output> Output::open() {
  auto device = std::make_unique<Device>();
  if (!device->open()) return std::nullopt;
  return Output(std::move(device));
}

bool Output::feed(Mixer& mixer) {
  return device_->feed(mixer);
}

const std::string& Output::name() const {
  return device_->name;
}

void quieten_libraries() {
  setenv("ALSOFT_LOGLEVEL", "0", 0);
  // ALSA, which OpenAL loads by itself, prints eight lines where there is no sound card.
  void* alsa = dlopen("libasound.so.2", RTLD_NOW);
  if (alsa == nullptr) return;
  using Handler = void (*)(const char*, int, const char*, int, const char*, ...);
  using SetHandler = int (*)(Handler);
  if (auto* set = reinterpret_cast<SetHandler>(dlsym(alsa, "snd_lib_error_set_handler")); set != nullptr) {
    set(say_nothing);
  }
}

}  // namespace stylet::sound
