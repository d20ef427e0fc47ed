"""The bearing inside other programs: a two-port whose ends move as they say."""
