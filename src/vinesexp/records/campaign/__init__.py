"""What a person states of a campaign: campaign.yaml, the test log, published values."""
