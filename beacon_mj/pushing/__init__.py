"""What a push sets in motion: the models that planners and the planar world share."""
