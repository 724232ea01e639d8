"""Pure: signals, units, waveforms, models and effects, controllers, comparison. No ROS, files, clock or threads."""
